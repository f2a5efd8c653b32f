"""Faults of the tables that are generated fault modes: how the twin carries them follows from those."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from homeostat.domain.diagnosis import EffectKind, FaultMode
from homeostat.knowledge.store.error import Code, Mistake, refuse
from homeostat.stl.spelling import near_matches
from homeostat.stl.units import in_unit


def with_effects(faults: Sequence[FaultMode], generated: Iterable[FaultMode]) -> tuple[FaultMode, ...]:
    """``faults``, those that are one of the ``generated`` modes with its effect.

    GraphError where there is no such mode, where no fault may be that, and where unit or range are not those of it.
    """
    modes = {mode.name: mode for mode in generated}
    wrong = [found for fault in faults if (found := _mistake(fault, modes)) is not None]
    refuse(wrong)
    return tuple(f if f.mode is None else replace(f, effect=modes[f.mode].effect) for f in faults)


def why_not(mode: FaultMode) -> str:
    """Why no fault of the tables may be this generated ``mode``; empty where one may."""
    if mode.effect is None or mode.effect.kind is EffectKind.UNSEEN:
        return "nothing simulates it"
    return "it swings, and a table states no period" if mode.effect.swings else ""


def _mistake(fault: FaultMode, modes: dict[str, FaultMode]) -> Mistake | None:
    if fault.mode is None:
        return None
    thing, mode = f"fault {fault.name!r}", modes.get(fault.mode)
    if mode is None or why_not(mode):
        known = sorted(name for name, each in modes.items() if not why_not(each))
        hint = near_matches(fault.mode, known) or f"; there are {', '.join(known)}"
        why = f"there is no generated mode {fault.mode!r}"
        if mode is not None:
            why = f"{fault.mode!r} cannot be a fault of the tables, {why_not(mode)}"
        return Mistake(Code.UNKNOWN_FAULT, thing, f"mode: {why}{hint}")
    if fault.severity_unit != mode.severity_unit:
        message = f"severity_unit is {fault.severity_unit!r}, that of {mode.name!r} is {mode.severity_unit!r}; say that"
        return Mistake(Code.BAD_WORD, thing, message)
    allowed, own = mode.severity_range, fault.severity_range
    if not (allowed.contains(own.low) and allowed.contains(own.high)):
        message = (
            f"low and high are {own.low:g} and {own.high:g}; what {mode.name!r} can be is {allowed.low:g} to "
            f"{allowed.high:g}{in_unit(mode.severity_unit)}; stay inside that"
        )
        return Mistake(Code.SEVERITY_OUTSIDE_RANGE, thing, message)
    return None
