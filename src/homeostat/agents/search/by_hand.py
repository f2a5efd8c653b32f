"""By hand: a plant in which nothing is wrong any more is brought near ordinary operation before it goes back.

A controller that has wound elsewhere while something was wrong takes minutes to come back, and the variable that it
controls is off its setpoint for as long. By hand its output stands at once where it is in ordinary operation, and the
integral follows: with the setpoints of ordinary operation the plant comes there by itself, and the way back moves
nothing more.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from homeostat.agents.search.gently import SOON_S, by_loop
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Revise
from homeostat.guard.requests.permissives import refusal
from homeostat.process.types import Cube
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Twin

LAST_S = 60.0
"""Stretch at the end of a rollout in which a controller has come to where it stays [s]."""
WORTH = 0.25
"""Excess that standing by hand must spare, in scales: it takes a release more [1]."""


def brought(
    plant: PlantDescription, twin: Twin, ensemble: Ensemble, now: tuple[str, Snapshot], back: tuple[ActionSet, float]
) -> dict[str, ActionSet]:
    """State -> what brings the plant near ordinary operation in it; empty where that is no better than going back.

    ``now``: the state and the readings; ``back``: the way back at once, and its excess on ``ensemble`` in scales.
    """
    home, off = back
    if off <= WORTH or twin.timing.ticks(twin.timing.time_s(SOON_S)) >= twin.horizon:
        return {}
    signals, dt_s = twin.try_many(ensemble, twin.schedules([home], twin.horizon), refuse=False)
    rest, found = _resting(plant, signals, max(math.ceil(twin.timing.time_s(LAST_S) / dt_s), 1)), {}
    soon = int(twin.timing.time_s(SOON_S) / dt_s)
    for state in _between(plant, *now):
        actions = _actions(plant, state, plant.machine.state(home.target), rest)
        if actions is None:
            continue
        signals, dt_s = twin.try_many(ensemble, twin.schedules([actions], twin.horizon), refuse=False)
        late = {tag: values[:, soon:] for tag, values in signals.items()}
        if float(by_loop(plant, late, 1).sum()) <= off - WORTH:
            found[state.name] = actions
    return found


def by_hand_first(target: str) -> Revise:
    """The refusal of a path to ``target``, which is not near ordinary operation or would leave it again."""
    text = f"the plant is brought near ordinary operation by hand before it goes to {target!r}; name another path"
    return Revise((refusal("CHK-BY-HAND", text, Owner.PLANNING),))


def _resting(plant: PlantDescription, signals: Mapping[str, Cube], rows: int) -> dict[str, float]:
    """Manual output -> where its controller comes to; those that come nowhere are left out."""
    means = {manual: float(signals[command][:, -rows:].mean()) for manual, command in plant.overridden.items()}
    return {manual: mean for manual, mean in means.items() if np.isfinite(mean)}


def _between(plant: PlantDescription, name: str, snapshot: Snapshot) -> Iterator[State]:
    """States of no more risk than that called ``name``, the least first, which one decision leads to."""
    machine, here = plant.machine, plant.machine.state(name)
    open_to = {
        t.target
        for t in machine.transitions
        if t.source == name and t.on_decision and t.event == machine.recovery_event and t.guard.holds(snapshot.values)
    }
    states = [machine.state(target) for target in open_to - machine.ordinary]
    yield from sorted((s for s in states if s.recovery_target and s.risk <= here.risk), key=lambda s: (s.risk, s.name))


def _actions(plant: PlantDescription, state: State, home: State, rest: Mapping[str, float]) -> ActionSet | None:
    """What ``home`` is commanded, in ``state``, whose outputs stand by hand; None where that does not admit it."""
    commands, by_hand = [], False
    for r in state.setpoints:
        tag, ordinary = plant.tag(r.tag), home.setpoint(r.tag)
        value: float | None = r.design if ordinary is None else ordinary.design
        if value is None and r.tag in rest and r.high > r.low:
            value, by_hand = tag.nearest(rest[r.tag]), True
        if not _admits(r, value):
            return None
        commands.append(Command(r.tag, value, None if value is None else tag.rate_limit))
    return replace(ActionSet((), state.name), commands=tuple(commands)) if by_hand else None


def _admits(admitted: SetpointRange, value: float | None) -> bool:
    """Whether a state may be commanded ``value`` of a tag; None stands for automatic."""
    if value is None:
        return admitted.design is None
    return admitted.low <= value <= admitted.high or value == admitted.design
