"""Recognition: which state of the machine the plant is in, by reading it."""

from __future__ import annotations

from homeostat.domain.behaviour import State, StateMachine
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.permissives import usable


def recognise(machine: StateMachine, readings: Snapshot, believed: str) -> str:
    """Name of the state that fits the accepted targets and the readings; ``believed`` where it fits or nothing does."""
    ordered = sorted(machine.states, key=lambda s: s.name != believed)
    return next((s.name for s in ordered if _fits(s, readings)), believed)


def _fits(state: State, readings: Snapshot) -> bool:
    """Whether every target that ``state`` states is held and its settling condition holds."""
    if not state.setpoints or not admits(state, readings, frozenset(r.tag for r in state.setpoints)):
        return False
    return state.settled_when.holds(usable(readings))


def admits(state: State, readings: Snapshot, tags: frozenset[str]) -> bool:
    """Whether ``state`` admits the accepted target of every one of ``tags`` that it states."""
    for admitted in state.setpoints:
        if admitted.tag not in tags:
            continue
        if admitted.tag not in readings.accepted:
            return False
        target = readings.accepted[admitted.tag]
        if target is None:
            if admitted.design is not None:
                return False
        elif not admitted.low - 1e-6 <= target <= admitted.high + 1e-6:
            return False
    return True
