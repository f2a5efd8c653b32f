"""Loops: are the signs of their gains right, do they come to their setpoints, and do they stand still there?"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from homeostat.domain.lasting import lasting
from homeostat.domain.plant.description import ControlLoop
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course
from homeostat.evaluate.lint.deep.resting import (
    SCALES,
    Rest,
    by_hand,
    end_of,
    last_of,
    overridden,
    rest_of,
)
from homeostat.evaluate.lint.finding import Finding, Place, Severity, amount

STILL: Final = 0.05
"""Share of its range by which an output may swing there without noise [1]."""
SHAKES: Final = 0.05
"""Standard deviation, as a share of its range, by which noise may move an output [1]."""
FOLLOWED: Final = 0.63
"""Share of a small step after which it is followed [1]."""
SLOWER: Final = 10.0
"""Multiple of the time for its whole range that a loop may take for a small step [1]."""
ROUND: Final = 1e-9
AVERAGED_S: Final = 30.0
"""For how long it is averaged where a loop has come to, by the reference [s]."""


def loops(bench: Bench) -> Iterator[Finding]:
    """Every loop that does not hold what it should."""
    bench.told("loops")
    for loop in bench.plant.description.loops:
        found = None
        if not by_hand(bench, loop) and not overridden(bench, loop):
            found = _rests(bench, loop) or _holds(bench, loop) or _follows(bench, loop)
        if found is not None:
            yield found


def _rests(bench: Bench, loop: ControlLoop) -> Finding | None:
    """It holds nothing, since what it would hold is on the safe side of its setpoint: what to state of that."""
    last, rest = last_of(bench.quiet, loop), rest_of(bench, loop)
    if last is None or rest is Rest.NO:
        return None
    output, pv = (bench.plant.description.tag(tag) for tag in (loop.manipulated_variable, loop.process_variable))
    off, place = float(last[0].mean()), bench.places.row("loops", id=loop.name)
    what = (
        f"loop {loop.name!r} rests: {pv.name!r} is {amount(abs(off), pv.unit)} {'below' if off < 0.0 else 'above'} its "
        f"setpoint at the end of a healthy course, with {output.name!r} at {end_of(output, last[1])}, and it acts "
        f"once {pv.name!r} is {'above' if off < 0.0 else 'below'} it"
    )
    if rest is Rest.STATED:
        what = f"{what}; nothing in ordinary operation shows whether it still moves, so that no release counts on it"
        return Finding(Severity.NOTE, "loops", place, what, "a proof test; nothing, where that is its design")
    setpoint = bench.places.row("setpoints", tag=loop.setpoint)
    remedy = (
        f"where that is its design, leave its symptom out (a row symptoms,S-{loop.name}-OFF of omitted.csv); "
        f"otherwise state a setpoint that can be reached ({setpoint}), or give the equipment more (parameters.csv)"
    )
    return Finding(Severity.WARNING, "loops", place, what, remedy)


def _holds(bench: Bench, loop: ControlLoop) -> Finding | None:
    """In the last part of the fault-free course it is at its setpoint and its output stands."""
    tag, output = (
        bench.plant.description.tag(loop.process_variable),
        bench.plant.description.tag(loop.manipulated_variable),
    )
    quiet, noisy = last_of(bench.quiet, loop), last_of(bench.noisy[0], loop)
    if quiet is None or noisy is None:
        return None  # said where the course broke
    (error, moved), (_, shaken) = quiet, noisy
    off, swing, shakes = abs(float(error.mean())), float(np.ptp(moved)), float(np.std(shaken))
    if shakes > SHAKES * output.range.span:  # a loop that makes up for what varies outside has to
        sheltered = last_of(bench.sheltered, loop)
        shakes = shakes if sheltered is None else float(np.std(sheltered[1]))
    if off > SCALES * tag.scale and (end := end_of(output, moved)):
        return _exhausted(bench, loop, end, amount(off, tag.unit), "at the end of a healthy course")
    if off > SCALES * tag.scale:
        what = (
            f"{tag.name!r} is off its setpoint by {amount(off, tag.unit)} on the mean at the end of a healthy course, "
            f"with {output.name!r} {_at(float(moved.mean()), output.unit)}: loop {loop.name!r} does not hold it"
        )
        return _finding(
            bench,
            loop,
            what,
            f"look at its action (acts), the signs of its gains ({gains_of(bench, loop)}) and its actuator",
        )
    if swing > STILL * output.range.span or shakes > SHAKES * output.range.span:
        how = (
            f"by {amount(swing, output.unit, 3)} without any noise" if swing > STILL * output.range.span
            else f"with a standard deviation of {amount(shakes, output.unit, 3)} under the noise of its instruments"
        )  # fmt: skip
        what = (
            f"{output.name!r} swings {how} in the last fifth of the fault-free course: loop {loop.name!r} is unstable"
        )
        return _finding(bench, loop, what, f"lower its gains ({gains_of(bench, loop)})")
    return None


def _exhausted(bench: Bench, loop: ControlLoop, end: str, off: str, when: str) -> Finding:
    """The actuator gives all that it has, and that is not enough."""
    place = bench.places.row("setpoints", tag=loop.setpoint)
    what = (
        f"{loop.process_variable!r} is still {off} off its setpoint {when}, and {loop.manipulated_variable!r} stands "
        f"at {end}: the actuator of loop {loop.name!r} has no more to give, and cannot reach the setpoint"
    )
    remedy = (
        f"state a setpoint that can be reached ({place}), give the equipment more (parameters.csv), or, where it only "
        f"takes longer, a longer horizon_s to [twin]; one at the wrong end has the wrong action (acts) or signs "
        f"of the gains ({gains_of(bench, loop)})"
    )
    return _finding(bench, loop, what, remedy)


def _at(mean: float, unit: str) -> str:
    """Where an output is; a setpoint that another controller sets has no value of its own."""
    return f"at {amount(mean, unit, 3)}" if np.isfinite(mean) else "set by it"


def _follows(bench: Bench, loop: ControlLoop) -> Finding | None:
    """It follows a small step of its setpoint, within the horizon of the twin.

    One that another controller sets is moved with that one.
    """
    d, plant = bench.plant.description, bench.plant
    pv, sp = d.tag(loop.process_variable), d.tag(loop.setpoint)
    if d.variables[sp.name] not in plant.model.inputs or not np.isfinite(bench.quiet.started_s):
        return None
    before = float(bench.quiet.true(sp.name)[-1])
    if not np.isfinite(before):
        return None
    size = min(5.0 * pv.scale, 0.2 * sp.range.span)
    target = before - size if before - size >= sp.range.low else before + size
    horizon_s = float(plant.twin.horizon_s)
    timing = d.timing
    begin_s = plant.end_s - horizon_s - timing.tick_s
    if begin_s <= bench.quiet.settled_s:
        return None

    def act(seen: Snapshot) -> ActionSet | None:
        state = bench.quiet.last_state
        return ActionSet((Command(sp.name, target, None),), state) if seen.at_s >= begin_s else None

    course = bench.acted((), act=act)
    if course.broke:
        what = f"the plant breaks after {sp.name!r} is set to {amount(target, sp.unit, 6)}: {course.broke}"
        return _finding(bench, loop, what, "mend the equations, or lower the gains")
    late = course.after(course.truth.times_s[-1] - timing.time_s(AVERAGED_S))
    reached = float((course.true(pv.name) - before)[late].mean())
    if abs(reached - (target - before)) <= 0.2 * size + ROUND:
        return _slow(bench, loop, course, begin_s, target)
    last = course.true(loop.manipulated_variable)[late]
    if end := end_of(d.tag(loop.manipulated_variable), last):
        when = f"after the twin's horizon of {lasting(horizon_s)}, for a setpoint of {amount(target, sp.unit, 6)}"
        return _exhausted(bench, loop, end, amount(abs(target - before - reached), pv.unit), when)
    went = "the other way" if reached * (target - before) < 0.0 else f"{abs(reached) / size:.0%} of the way"
    what = (
        f"{pv.name!r} goes {went} within the twin's horizon of {lasting(horizon_s)} after {sp.name!r} is set from "
        f"{before:g} to {amount(target, sp.unit, 6)}: a rollout does not show where loop {loop.name!r} leads"
    )
    remedy = f"correct the gains ({gains_of(bench, loop)}), or give [twin] a longer horizon_s"
    return _finding(bench, loop, what, remedy)


def _slow(bench: Bench, loop: ControlLoop, course: Course, begin_s: float, target: float) -> Finding | None:
    """What the tables say of how fast the equipment follows is what it does."""
    rule, sp = bench.plant.description.writables.get(loop.setpoint), bench.plant.description.tag(loop.setpoint)
    if rule is None or rule.fastest is None:
        return None
    stated_s = sp.range.span / rule.fastest
    late = course.after(begin_s)
    values = course.true(loop.process_variable)[late]
    there = np.abs(values - target) <= (1.0 - FOLLOWED) * abs(values[0] - target)
    ticks = np.argmax(there) if there.any() else late.sum()
    follows_s, tick_s = float(ticks) * course.truth.dt_s, course.truth.dt_s
    if follows_s <= SLOWER * max(stated_s, tick_s):
        return None
    row = bench.places.row("writables", tag=sp.name)
    what = (
        f"{loop.process_variable!r} has followed a small step of {sp.name!r} by {FOLLOWED:.0%} after "
        f"{lasting(follows_s)}, and fastest = {amount(rule.fastest, sp.unit, 6)}/s says that its whole range takes "
        f"{stated_s:g} s ({row})"
    )
    remedy = "correct fastest, the loop's gains, or the time constant of its actuator in parameters.csv"
    return _finding(bench, loop, what, remedy)


def _finding(bench: Bench, loop: ControlLoop, what: str, remedy: str) -> Finding:
    return Finding(Severity.ERROR, "loops", bench.places.row("loops", id=loop.name), what, remedy)


def gains_of(bench: Bench, loop: ControlLoop) -> str:
    """Where the gains are stated."""
    places: list[Place] = [bench.places.row("parameters", symbol=symbol) for symbol in (loop.gain, loop.reset)]
    return ", ".join(map(str, places))
