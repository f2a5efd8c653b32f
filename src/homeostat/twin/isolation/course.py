"""Course: what grew, or changed several times, and what it has come to as one lasting change of the same quantity."""

from collections.abc import Mapping
from dataclasses import replace

from homeostat.domain.diagnosis import SIZELESS, Effect, FaultMode, FaultState
from homeostat.twin.carried import FaultSet

REACHED = tuple(0.85**k for k in range(1, 15))
"""Shares of what it would be if it still grew, that something may have come to [1]."""


def change_of(fault: FaultState, effect: Effect, end_s: float) -> float:
    """By how much the quantity has changed at ``end_s`` [s], in its unit."""
    return fault.severity * effect.per_unit * (end_s - fault.onset_s if effect.grows else 1.0)


def lasting(course: FaultSet, modes: Mapping[str, FaultMode], end_s: float) -> FaultState:
    """What a ``course`` of changes of one quantity comes to at ``end_s`` [s], as one lasting change since it began."""
    changes = [(change, _effect(modes[change.fault])) for change in course]
    total = sum(change_of(change, effect, end_s) for change, effect in changes)
    mode = _lasting_mode(changes[0][1], total, modes)
    size = total if mode.severity_range.low < 0.0 else abs(total)
    return FaultState(mode.name, size, min(change.onset_s for change in course))


def stopped(
    faults: FaultSet, old: FaultSet, modes: Mapping[str, FaultMode], first_s: float, end_s: float
) -> list[tuple[FaultSet, FaultSet]]:
    """``faults`` where one of them that is ``old`` and grew does so no more since some time, and what is replayed then.

    What stopped before the readings from ``first_s`` to ``end_s`` [s] lasts in all of them. What stopped among them is
    replayed as growing until then.
    """
    found: list[tuple[FaultSet, FaultSet]] = []
    for k, fault in enumerate(faults):
        effect = modes[fault.fault].effect
        if fault not in old or effect is None or not effect.grows:
            continue
        for share in REACHED:
            at_s = fault.onset_s + share * (end_s - fault.onset_s)
            course = (fault, replace(fault, severity=-fault.severity, onset_s=at_s))
            rest = lasting(course, modes, end_s)
            others = (*faults[:k], *faults[k + 1 :])
            found.append(((*others, rest), (*others, *course) if at_s >= first_s else (*others, rest)))
    return found


def turned_back(state: FaultState, known: FaultSet, first_s: float) -> FaultState | None:
    """``state`` as what was ``known`` before ``first_s`` [s] to swing, so many turns earlier; None where nothing was.

    It keeps the sign that it had: half a turn later is the other one. What begins later than ``first_s`` is another
    swing, and was none before.
    """
    for before in known:
        if state.fault == before.fault and state.period_s and max(before.onset_s, state.onset_s) < first_s:
            same = state.severity * before.severity > 0.0
            other = 0.0 if same else 0.5
            turns = round((state.onset_s - before.onset_s) / state.period_s - other) + other
            size = state.severity if same else -state.severity
            return replace(state, severity=size, onset_s=state.onset_s - turns * state.period_s)
    return None


def continues(fault: FaultState, known: FaultState, modes: Mapping[str, FaultMode]) -> bool:
    """Whether ``fault`` is what was ``known``, by whatever name, or what that has come to where it grew."""
    if fault.fault == known.fault:
        return True
    now, before = modes[fault.fault].effect, modes[known.fault].effect
    if now is None or before is None or (now.grows and not before.grows) or (before.swings and not now.swings):
        return False
    same = (now.kind, now.quantity) == (before.kind, before.quantity)
    sided = now.per_unit * fault.severity * before.per_unit * known.severity >= 0.0
    return same and (sided or now.swings)  # half a turn looks like what lasts, on either side


def _effect(mode: FaultMode) -> Effect:
    assert mode.effect is not None, "courses are of generated modes"
    return mode.effect


def _lasting_mode(effect: Effect, total: float, modes: Mapping[str, FaultMode]) -> FaultMode:
    """The mode that lasts and changes the quantity of ``effect`` by ``total``."""
    nameless = [mode for mode in modes.values() if not mode.listed]
    every = [(mode, mode.effect) for mode in nameless if mode.effect is not None and mode.effect.lasts]
    same = [(mode, own) for mode, own in every if own.quantity == effect.quantity and own.kind not in SIZELESS]
    return next((mode for mode, own in same if mode.unknown or own.per_unit * total >= 0.0), same[0][0])
