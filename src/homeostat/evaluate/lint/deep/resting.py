"""Which loops hold nothing by design at the end of a healthy course, so that one off its setpoint there is no mistake.

One whose actuator is commanded by hand; one that another loop overrides; and one that rests: what it holds is on the
safe side of its setpoint, its output stands at the end at which its actuator does nothing, and it acts once its
setpoint is crossed. That end is the lower one. A controller that has given all that it has looks the same from there,
since the sign of its deviation is that of its output either way: at the upper end a loop rests only where the tables
say so, by leaving its symptom out. Nothing that is needed rests: what a criterion or a limit asks of it has to hold.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Final

import numpy as np

from homeostat.domain.plant.description import ControlLoop, Relation
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course
from homeostat.evaluate.lint.finding import amount
from homeostat.knowledge.build.derived.tables import stated_tables

LATE: Final = 0.2
"""Share of a course at its end in which a loop has to stand still [1]."""
SCALES: Final = 2.0
"""Scales of its tag by which a loop may be off its setpoint there [1]."""
END: Final = 0.01
"""Share of its range by which the mean of an output may be off an end at which it stands [1]."""
HALF: Final = 0.5
"""Share of the course after which an actuator is moved by hand, or a setpoint across what is measured [1]."""
STEP: Final = 5.0
"""Scales of its tag by which it is moved beyond that [1]."""


class Rest(StrEnum):
    """Whether a loop rests at the end of its output."""

    NO = "no"
    """It does not."""
    SEEMS = "seems"
    """It would act if its setpoint were crossed, and the tables do not say that it rests."""
    STATED = "stated"
    """So it would, and the tables leave its symptom out."""


def by_hand(bench: Bench, loop: ControlLoop) -> bool:
    """Whether the healthy course ends with the loop's actuator commanded by hand, as a batch does: nothing is held."""
    d, times_s = bench.plant.description, bench.quiet.truth.times_s
    driven = next(s.component for s in d.signals if s.tag.name == loop.manipulated_variable)
    manual = [s.tag.name for s in d.signals if s.relation is Relation.OVERRIDES and s.component == driven]
    late = bench.quiet.after((1.0 - LATE) * times_s[-1])
    return any(bool(np.isfinite(bench.quiet.true(name)[late]).any()) for name in manual)


def overridden(bench: Bench, loop: ControlLoop) -> bool:
    """Whether another loop moves the same actuator in its place at the end of the healthy course: nothing is held."""
    if not is_off(bench, loop):
        return False
    rivals = [
        each
        for each in bench.plant.description.loops
        if each.manipulated_variable == loop.manipulated_variable and each != loop
        and np.isfinite(bench.quiet.true(each.setpoint)[-1])  # else it is the inner one of a cascade
    ]  # fmt: skip
    return any(not is_off(bench, each) for each in rivals)


def is_off(bench: Bench, loop: ControlLoop) -> bool:
    """Whether a loop is off its setpoint at the end of the healthy course."""
    last, tag = last_of(bench.quiet, loop), bench.plant.description.tag(loop.process_variable)
    return last is not None and abs(float(last[0].mean())) > SCALES * tag.scale


def rest_of(bench: Bench, loop: ControlLoop) -> Rest:
    """Whether a loop that is off its setpoint rests at the end of the healthy course, with its output at an end."""
    return bench.kept(f"rest of {loop.name}", lambda: _rest_of(bench, loop))


def _rest_of(bench: Bench, loop: ControlLoop) -> Rest:
    if not is_off(bench, loop):  # nor is one whose course broke
        return Rest.NO
    d, late = bench.plant.description, bench.quiet.after((1.0 - LATE) * bench.quiet.truth.times_s[-1])
    ends = [end_of(d.tag(name), bench.quiet.true(name)[late]) for name in _outputs(bench, loop)]
    if not all(ends) or _needed(bench, loop):
        return Rest.NO
    if not all(end.startswith("its lower") for end in ends) and not _left_out(bench, loop):
        return Rest.NO
    if not _acts_beyond(bench, loop):
        return Rest.NO
    stated = all(rule.feature != f"F-{loop.name}" for rule in d.symptom_rules)
    return Rest.STATED if stated else Rest.SEEMS


def _outputs(bench: Bench, loop: ControlLoop) -> tuple[str, ...]:
    """Every command that a loop moves: a split range has several, of which its description knows the first."""
    stated = bench.kept("loops as stated", lambda: stated_tables(bench.folder)[0].get("loops"))
    cells = [row.get("mv", "") for row in stated.rows if row.get("id") == loop.name] if stated is not None else []
    known = {signal.tag.name for signal in bench.plant.description.signals}
    names = [name.strip() for name in "|".join(cells).split("|")]
    return tuple(dict.fromkeys((loop.manipulated_variable, *(name for name in names if name in known))))


def _left_out(bench: Bench, loop: ControlLoop) -> bool:
    """Whether a row of the tables leaves out the symptom of this loop, and not those of some."""
    names = (f"S-{loop.name}-OFF", f"F-{loop.name}")
    return any(bench.places.row("omitted", row=name).row is not None for name in names)


def _needed(bench: Bench, loop: ControlLoop) -> bool:
    """Whether a criterion, or a limit that always counts, asks for what the loop does not give: it does not hold."""
    d, course = bench.plant.description, bench.quiet
    deviations = {s.tag.name for s in d.signals if s.relation is Relation.REPORTS and s.component == loop.controller}
    own = {loop.process_variable} | deviations
    late = course.after((1.0 - LATE) * course.truth.times_s[-1])
    asked = [criterion.formula for criterion in d.limits.criteria]
    asked += [limit.formula for limit in d.limits.limits if limit.kind is not LimitKind.PERMISSIVE]
    for formula in asked:
        judged = late & (course.truth.times_s <= course.truth.times_s[-1] - formula.horizon_s)
        if own & formula.tags and judged.any():
            margins = formula.margins(course.truth.signals, course.truth.dt_s)[0]
            if float(np.mean(margins[judged] < 0.0)) > LATE:
                return True
    return False


def _acts_beyond(bench: Bench, loop: ControlLoop) -> bool:
    """Whether its output leaves its end once its setpoint is moved across what it holds, which does not go away then.

    A setpoint that nobody can move shows nothing: it does not.
    """
    d, quiet, setpoint = bench.plant.description, bench.quiet, loop.setpoint
    sp, pv, error = d.tag(setpoint), d.tag(loop.process_variable), last_of(quiet, loop)
    if error is None or d.variables[setpoint] not in bench.plant.model.inputs:
        return False
    stated, off = float(quiet.true(setpoint)[-1]), float(error[0].mean())
    size = min(STEP * pv.scale, LATE * sp.range.span)
    target = min(max(stated + off + float(np.sign(off)) * size, sp.range.low), sp.range.high)
    if not np.isfinite(stated) or abs(target - stated) <= abs(off):
        return False  # it is moved by another controller, or its range ends before what is measured
    begin_s = max(HALF * bench.plant.end_s, min(quiet.settled_s, (1.0 - LATE) * bench.plant.end_s))

    def act(seen: Snapshot) -> ActionSet | None:
        actions = ActionSet((Command(setpoint, target, None),), quiet.last_state)
        return actions if seen.at_s >= begin_s else None

    bench.told(f"{setpoint} across {pv.name}")
    course = bench.acted((), act=act)
    if course.broke:
        return False
    name, after = loop.manipulated_variable, course.after(begin_s)
    left = np.abs(course.true(name) - quiet.true(name))[after] > END * d.tag(name).range.span
    went = float((course.true(pv.name) - quiet.true(pv.name))[-1])
    return bool(left.any()) and went * float(np.sign(off)) >= -SCALES * pv.scale


def end_of(output: Tag, moved: np.ndarray) -> str:
    """At which end of its range an output stands, with the value; empty where it does not."""
    if not np.isfinite(moved).all():  # another controller is moved by it
        return ""
    mean, near = float(moved.mean()), END * output.range.span
    for name, value in (("lower", output.range.low), ("upper", output.range.high)):
        if abs(mean - value) <= near:
            return f"its {name} end, {amount(value, output.unit)}"
    return ""


def last_of(course: Course, loop: ControlLoop) -> tuple[np.ndarray, np.ndarray] | None:
    """Deviation and output at the end of a course; None where it broke."""
    if course.broke:
        return None
    late = course.after((1.0 - LATE) * course.truth.times_s[-1])
    given = course.true(loop.setpoint)[late]
    error = course.true(loop.process_variable)[late] - given
    if np.isnan(given).any():  # another controller sets it
        signals = course.plant.description.signals
        own = [s.tag.name for s in signals if s.relation is Relation.REPORTS and s.component == loop.controller]
        error = course.true(own[0])[late] if own else np.zeros_like(error)
    return error, course.true(loop.manipulated_variable)[late]
