"""What disturbances do to a true plant, second by second: its row of parameters, and the targets that people move."""

from collections.abc import Mapping, Sequence
from typing import final

from homeostat.domain.disturbance import Disturbance, DisturbanceError, Effect
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.tag import Role
from homeostat.domain.recovery import Command
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
    """What can be disturbed: parameters, commanded tags, instruments and actuators of one plant."""

    def __init__(self, model: ProcessModel, departures: Departures, plant: PlantDescription) -> None:
        self._parameters = (*model.parameters, *departures.parameters)
        variables = plant.variables
        self._readings = {tag: v for tag, v in variables.items() if v in departures.instruments}
        self._moved = tuple(
            s.tag.name for s in plant.signals
            if s.variable in model.inputs and s.tag.role in (Role.SP, Role.MV) and s.relation is not Relation.OVERRIDES
        )  # fmt: skip
        self._actuators = tuple(departures.actuators)
        self._symbols = model.parameters

    def column(self, disturbance: Disturbance) -> int | None:
        """The parameter that ``disturbance`` acts on; None where it moves a commanded tag.

        DisturbanceError where the plant has nothing of that name that can be disturbed like that.
        """
        name, effect = disturbance.name, disturbance.effect
        if effect in (Effect.PLUS, Effect.TIMES):
            if name in self._symbols:
                return self._parameters.index(name)
            if name in self._moved:
                return None
            if name in self._readings:
                raise DisturbanceError(f"{name!r} is a reading; say '{name} reads {effect.value} {disturbance.size:g}'")
            raise self._unknown(name, "parameter or commanded tag", (*self._symbols, *self._moved))
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

    def __init__(self, targets: Targets, disturbances: Sequence[Disturbance]) -> None:
        """``targets``: what the plant has; DisturbanceError where it cannot have one of the ``disturbances``."""
        found = [(targets.column(d), d) for d in disturbances]
        self._columns = tuple((column, d) for column, d in found if column is not None)
        self._moves = tuple(d for column, d in found if column is None)
        self._commanded: dict[Disturbance, tuple[float, float]] = {}

    def act(self, usual: Vec, parameters: Vec, at_s: float) -> None:
        """Set in ``parameters`` what the ``usual`` ones become at ``at_s`` [s], in the order of the disturbances."""
        for column, _ in self._columns:
            parameters[column] = usual[column]
        for column, disturbance in self._columns:
            parameters[column] = disturbance.applied(parameters[column], at_s)

    def commands(self, accepted: Mapping[str, float | None], at_s: float) -> tuple[Command, ...]:
        """What people change in the second that begins at ``at_s`` [s]; ``accepted``: the present targets.

        What somebody else has commanded meanwhile is what they go on from.
        """
        moved: list[Command] = []
        for d in self._moves:
            present = accepted[d.name]
            if present is None or d.share(at_s) == d.share(at_s - 1.0):
                continue
            undisturbed, commanded = self._commanded.get(d, (present, present))
            if present != commanded:
                undisturbed = present
            value = d.applied(undisturbed, at_s)
            self._commanded[d] = undisturbed, value
            moved.append(Command(d.name, value, None))
        return tuple(moved)
