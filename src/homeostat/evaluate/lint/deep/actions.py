"""Loops that act the wrong way: their actuator stands at one end, and would help at the other.

They are looked for before everything else that a fault-free course shows: a plant with one shows little but that.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from homeostat.domain.plant.description import ControlLoop, Relation
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.loops import gains_of
from homeostat.evaluate.lint.deep.mended import restless, stated_action, with_factors
from homeostat.evaluate.lint.deep.resting import HALF, SCALES, by_hand, end_of, last_of, overridden
from homeostat.evaluate.lint.finding import Finding, Severity, amount

HELPS: Final = 0.2
"""Share of its deviation by which a reading comes nearer to its setpoint then [1]."""


def actions(bench: Bench) -> Iterator[Finding]:
    """Every loop that would hold what it should if it acted the other way."""
    if bench.quiet.broke:
        return
    loops = [e for e in bench.plant.description.loops if not by_hand(bench, e) and not overridden(bench, e)]
    found = {loop.name: finding for loop in loops for finding in _turned(bench, loop)}
    left = {name: _left(bench, name) for name in found}
    causes = [name for name, loops in left.items() if not loops]
    if not causes:  # several may act the wrong way, and one that would not hold either way has another trouble
        causes = [name for name, loops in left.items() if len(found) > 1 or name not in loops]
    yield from (found[name] for name in causes)


def _left(bench: Bench, name: str) -> set[str]:
    """Which loops do not hold once this one is turned round; it alone where the plant breaks then."""
    loop = next(each for each in bench.plant.description.loops if each.name == name)
    gains = [symbol for symbol in (loop.gain, loop.reset) if symbol in bench.plant.model.parameters]
    course = with_factors(bench, dict.fromkeys(gains, -1.0))
    return {name} if course.broke else {each.loop.name for each in restless(bench, course)}


def _turned(bench: Bench, loop: ControlLoop) -> Iterator[Finding]:
    d, found = bench.plant.description, last_of(bench.quiet, loop)
    pv, output = d.tag(loop.process_variable), d.tag(loop.manipulated_variable)
    driven = next(s.component for s in d.signals if s.tag.name == output.name)
    manual = next((s for s in d.signals if s.relation is Relation.OVERRIDES and s.component == driven), None)
    if found is None or manual is None or manual.variable not in bench.plant.model.inputs:
        return
    off, where = float(found[0].mean()), end_of(output, found[1])
    if not abs(off) > SCALES * pv.scale or not where:
        return
    low = abs(float(found[1].mean()) - output.range.low) < abs(float(found[1].mean()) - output.range.high)
    other = manual.tag.range.high if low else manual.tag.range.low
    moved = _moved(bench, loop, manual.tag.name, other)
    if moved is None or moved * off >= 0.0 or abs(moved) < max(HELPS * abs(off), SCALES * pv.scale):
        return
    what = (
        f"loop {loop.name!r} acts the wrong way: {pv.name!r} is {amount(abs(off), pv.unit)} "
        f"{'below' if off < 0.0 else 'above'} its setpoint at the end of a healthy course with {output.name!r} at "
        f"{where}, and with {manual.tag.name!r} = {other:g} it {'falls' if moved < 0.0 else 'rises'} by "
        f"{amount(abs(moved), pv.unit)}"
    )
    place = stated_action(bench, loop)
    remedy = (
        f"turn acts round (1 where more of {pv.name!r} needs more output, -1 where it needs less), or the signs of "
        f"both gains ({gains_of(bench, loop)})"
    )
    yield Finding(Severity.ERROR, "actions", place, what, remedy)


def _moved(bench: Bench, loop: ControlLoop, manual: str, value: float) -> float | None:
    """By how much what the loop holds is higher at the end if its actuator is moved by hand; None where that breaks."""
    begin_s = HALF * bench.plant.end_s

    def act(seen: Snapshot) -> ActionSet | None:
        state = bench.quiet.last_state
        return ActionSet((Command(manual, value, None),), state) if seen.at_s >= begin_s else None

    course = bench.acted((), act=act)
    if course.broke:
        return None
    return float(course.true(loop.process_variable)[-1] - bench.quiet.true(loop.process_variable)[-1])
