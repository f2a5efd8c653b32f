"""What disturbances do to a true plant, tick by tick: its row of parameters, and the targets that people move."""

import math
from collections.abc import Mapping, Sequence
from typing import final

from homeostat.domain.disturbance import Disturbance, DisturbanceError, Effect
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.tag import Role
from homeostat.domain.recovery import Command
from homeostat.links.truth.acting import Acting, acting
from homeostat.process.departures import Departures
from homeostat.process.model import ProcessModel
from homeostat.process.types import Vec
from homeostat.stl.spelling import near_matches

_COLUMN = {
    Effect.READS_PLUS: "offset",
    Effect.READS_TIMES: "gain",
    Effect.FROZEN: "frozen",
    Effect.NOISE: "noise",
    Effect.STICTION: "stiction",
    Effect.SLOW: "lag_s",
}
"""Effect on an instrument or an actuator -> its parameter."""


class Targets:
    """What can be disturbed: parameters, inputs, setpoints, instruments and actuators of one plant."""

    def __init__(self, model: ProcessModel, departures: Departures, plant: PlantDescription) -> None:
        self._parameters, self._symbols = (*model.parameters, *departures.parameters), model.parameters
        variables = plant.variables
        self._readings = {tag: v for tag, v in variables.items() if v in departures.instruments}
        self._actuators = tuple(departures.actuators)
        given = [s for s in plant.signals if s.variable in model.inputs and s.relation is not Relation.OVERRIDES]
        commanded = [s for s in given if s.tag.name not in plant.moved]
        self.inputs = {s.tag.name: model.inputs.index(s.variable) for s in commanded if s.tag.role is Role.MV}
        """Tag of a command that reaches the plant directly -> its input."""
        self.setpoints = tuple(s.tag.name for s in commanded if s.tag.role is Role.SP)
        """Tags that people move."""
        self.ranges = {s.tag.name: s.tag.range for s in commanded}
        """Tag of an input or a setpoint -> what it can be."""

    def column(self, disturbance: Disturbance) -> int | None:
        """The parameter that ``disturbance`` acts on; None where it is about an input or a setpoint.

        DisturbanceError where the plant has nothing of that name that can be disturbed like that.
        """
        name, effect = disturbance.name, disturbance.effect
        if effect in (Effect.PLUS, Effect.TIMES):
            if name in self._symbols:
                return self._parameters.index(name)
            if name in self.ranges:
                return None
            if name in self._readings:
                raise DisturbanceError(f"{name!r} is a reading; say '{name} reads {effect.value} {disturbance.size:g}'")
            raise self._unknown(name, "parameter or commanded tag", (*self._symbols, *self.ranges))
        of_actuator = effect in (Effect.STICTION, Effect.SLOW)
        known = self._actuators if of_actuator else tuple(self._readings)
        if name not in known:
            raise self._unknown(name, "actuator" if of_actuator else "instrument with the tag", known)
        of = name if of_actuator else self._readings[name]
        return self._parameters.index(f"{of} {_COLUMN[effect]}")

    def _unknown(self, name: str, what: str, known: Sequence[str]) -> DisturbanceError:
        hint = near_matches(name, known) or f"; these can be disturbed: {', '.join(known)}"
        return DisturbanceError(f"the plant has no {what} {name!r}{hint}")


@final
class Disturbed:
    """Disturbances that act on one plant."""

    def __init__(self, targets: Targets, disturbances: Sequence[Disturbance], tick_s: float, seed: int = 0) -> None:
        """``targets``: what the plant has; ``tick_s``: how long what people change has stood when it is looked at [s].

        ``seed``: of the courses that chance gives.

        DisturbanceError where the plant cannot have one of the ``disturbances``.
        """
        self._tick_s = tick_s
        found = [(targets.column(each.what), each) for each in acting(disturbances, seed)]
        self._columns = tuple((column, each) for column, each in found if column is not None)
        self._inputs = tuple((targets.inputs[d.name], d) for column, d in found if d.name in targets.inputs)
        moved = {d.name: None for column, d in found if column is None and d.name in targets.setpoints}
        self._moves: dict[str, list[Acting]] = {tag: [d for _, d in found if d.name == tag] for tag in moved}
        self._ranges = targets.ranges
        self._moved: dict[str, tuple[float, float, list[float]]] = {}

    @property
    def acts_on_inputs(self) -> bool:
        """Whether one of them is about a command on its way to the plant."""
        return bool(self._inputs)

    def act(self, usual: Vec, parameters: Vec, at_s: float) -> None:
        """Set in ``parameters`` what the ``usual`` ones become at ``at_s`` [s], in the order of the disturbances."""
        for column, _ in self._columns:
            parameters[column] = usual[column]
        for column, each in self._columns:
            parameters[column] = each.applied(parameters[column], at_s)

    def inputs(self, commanded: Vec, at_s: float) -> Vec:
        """What of the ``commanded`` inputs reaches the plant at ``at_s`` [s], within the ranges of their tags."""
        now = [(column, d) for column, d in self._inputs if d.share(at_s) != 0.0]
        reached = commanded.copy() if now else commanded
        for column, d in now:
            reached[column] = self._ranges[d.name].clip(d.applied(float(reached[column]), at_s))
        return reached

    def commands(self, accepted: Mapping[str, float | None], at_s: float) -> tuple[Command, ...]:
        """What people change in the tick that begins at ``at_s`` [s]; ``accepted``: the present targets.

        What somebody else has commanded meanwhile undoes what was moved before, and is what they go on from; the tag's
        range is what can be commanded.
        """
        found: list[Command] = []
        for tag, moves in self._moves.items():
            present, shares = accepted[tag], [d.share(at_s) for d in moves]
            before = [d.share(at_s - self._tick_s) for d in moves]
            if present is None or shares == before:
                continue
            base, last, undone = self._moved.get(tag, (present, math.nan, [0.0] * len(moves)))
            if present != last:
                base, undone = present, before
            value = base
            for d, share, lost in zip(moves, shares, undone, strict=True):
                value = d.what.changed(value, share - lost if d.what.from_s <= at_s < d.what.to_s else 0.0)
            value = self._ranges[tag].clip(value)
            self._moved[tag] = base, value, undone
            found.append(Command(tag, value, None))
        return tuple(found)
