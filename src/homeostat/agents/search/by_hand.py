"""By hand: a plant in which nothing is wrong any more is brought near ordinary operation before it goes back.

A controller that has wound elsewhere while something was wrong takes minutes to come back, and the variable that it
controls is off its setpoint for as long. By hand its output stands at once where it is in ordinary operation, and the
integral follows: with the setpoints of ordinary operation the plant comes there by itself, and the way back moves
nothing more.
"""

import math
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from homeostat.agents.search.gently import ramped
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.recovery import ActionSet, Command
from homeostat.process.types import Cube, Flags


def resting(plant: PlantDescription, signals: Mapping[str, Cube], rows: int) -> dict[str, float]:
    """Manual output -> where its controller stands in the last ``rows``; those that stand nowhere are left out.

    ``signals``: tag -> values, shape (members, times).
    """
    means = {manual: float(signals[command][:, -rows:].mean()) for manual, command in plant.overridden.items()}
    return {manual: mean for manual, mean in means.items() if math.isfinite(mean)}


def by_hand(
    plant: PlantDescription, here: str, values: Mapping[str, float], home: State, rest: Mapping[str, float]
) -> list[ActionSet]:
    """What brings the plant near ``home``, in each state that admits it, the least risky first.

    From the state called ``here``, where it reads ``values``, one decision leads to each of them. ``rest``: manual
    output -> where it is to stand.
    """
    found = (_actions(plant, state, home, rest) for state in _between(plant, here, values))
    return [actions for actions in found if actions is not None]


def following(
    plant: PlantDescription, actions: ActionSet, values: Mapping[str, float], times_s: Iterable[float]
) -> Iterator[ActionSet]:
    """``actions`` whose setpoints, of loops whose outputs stand by hand, take each of ``times_s`` from ``values`` [s].

    These move nothing, and say where the variable is expected meanwhile: one that is far from its setpoint is taken for
    a sign that something is wrong.
    """
    held = {plant.overridden[c.tag] for c in actions.commands if c.tag in plant.overridden and c.value is not None}
    setpoints = {loop.setpoint for loop in plant.loops if loop.manipulated_variable in held}
    for seconds in times_s:
        yield ramped(actions, values, seconds, setpoints)


def _between(plant: PlantDescription, here: str, values: Mapping[str, float]) -> Iterator[State]:
    """States of no more risk than that called ``here`` to which one decision leads."""
    machine, most = plant.machine, plant.machine.state(here).risk
    ways = [t for t in machine.transitions if t.source == here and t.on_decision and t.event == machine.recovery_event]
    names = {t.target for t in ways if t.guard.holds(values)} - machine.ordinary
    states = [s for s in map(machine.state, names) if s.recovery_target and s.risk <= most]
    yield from sorted(states, key=lambda s: (s.risk, s.name))


def _actions(plant: PlantDescription, state: State, home: State, rest: Mapping[str, float]) -> ActionSet | None:
    """What ``home`` is commanded, in ``state``, whose outputs stand by hand; None where that does not admit it."""
    commands, held = [], False
    for r in state.setpoints:
        tag, ordinary = plant.tag(r.tag), home.setpoint(r.tag)
        value = r.design if ordinary is None else ordinary.design
        if value is None and r.tag in rest and r.high > r.low:
            value, held = tag.nearest(rest[r.tag]), True
        if not _admits(r, value):
            return None
        commands.append(Command(r.tag, value, None if value is None else tag.rate_limit))
    return ActionSet(tuple(commands), state.name) if held else None


def _admits(admitted: SetpointRange, value: float | None) -> bool:
    """Whether a state may be commanded ``value`` of a tag; None stands for automatic."""
    if value is None:
        return admitted.design is None
    return admitted.low <= value <= admitted.high


def reaches(state: State, signals: Mapping[str, Cube], dt_s: float, count: int) -> Flags:
    """Whether each of ``count`` action sets has led to ``state`` at the end, in every member; shape (count,).

    ``signals``: tag -> values, shape (count * members, times).
    """
    last = {tag: values[:, -1:] for tag, values in signals.items()}
    margins = np.broadcast_to(state.settled_when.margins(last, dt_s), (len(next(iter(last.values()))), 1))
    return np.asarray((margins[:, 0] >= 0.0).reshape(count, -1).all(axis=1))
