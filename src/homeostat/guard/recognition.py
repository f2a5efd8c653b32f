"""Recognition: which state of the machine the plant is in, by reading it."""

from __future__ import annotations

from homeostat.domain.behaviour import State, StateMachine, Transition
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.permissives import usable


def recognise(machine: StateMachine, readings: Snapshot, believed: str) -> str:
    """Name of the state that fits the accepted targets and the readings; ``believed`` where it fits or nothing does."""
    ordered = sorted(machine.states, key=lambda s: s.name != believed)
    return next((s.name for s in ordered if _fits(s, readings)), believed)


def followed(machine: StateMachine, readings: Snapshot, believed: str) -> str | None:
    """State in which a plant stands that runs by itself and was in ``believed``; None where nobody can tell.

    As long as it holds the targets of ``believed`` it is there. Otherwise one state, and no other, must fit: a vessel
    that is closed may be idle, held or complete, and what follows differs.
    """
    if holds_targets(machine.state(believed), readings):
        return believed
    found = [s.name for s in machine.states if _fits(s, readings)]
    return found.pop() if len(found) == 1 else None


def step_made(machine: StateMachine, readings: Snapshot, state: str) -> Transition | None:
    """Transition out of ``state`` that a plant has taken by itself: its guard holds, and so do its state's targets."""
    values = usable(readings)
    made = [
        t for t in machine.transitions
        if t.source == state and not t.on_decision and t.guard.holds(values)
        and holds_targets(machine.state(t.target), readings)
    ]  # fmt: skip
    return min(made, key=lambda t: machine.state(t.target).risk, default=None)


def holds_targets(state: State, readings: Snapshot) -> bool:
    """Whether every target that ``state`` states is held; a plant that tells no target at all is taken at its word.

    Local control hands manual outputs back to automatic when it takes over; the plant has left no state by that.
    """
    told = readings.accepted
    return not told or all(
        r.tag in told and (told[r.tag] is None or _held(state, r.tag, readings)) for r in state.setpoints
    )


def admits(state: State, tag: str, target: float | None) -> bool:
    """Whether ``state`` admits ``target`` for ``tag``, None being automatic."""
    admitted = state.setpoint(tag)
    if admitted is None:
        return False
    if target is None:
        return admitted.design is None
    return admitted.low - 1e-6 <= target <= admitted.high + 1e-6


def _held(state: State, tag: str, readings: Snapshot) -> bool:
    return tag in readings.accepted and admits(state, tag, readings.accepted[tag])


def _fits(state: State, readings: Snapshot) -> bool:
    """Whether every target that ``state`` states is held and its settling condition holds."""
    held = bool(state.setpoints) and all(_held(state, r.tag, readings) for r in state.setpoints)
    return held and state.settled_when.holds(usable(readings))


def admits_all(state: State, readings: Snapshot, tags: frozenset[str]) -> bool:
    """Whether ``state`` admits the accepted target of every one of ``tags`` that it states."""
    return all(_held(state, r.tag, readings) for r in state.setpoints if r.tag in tags)
