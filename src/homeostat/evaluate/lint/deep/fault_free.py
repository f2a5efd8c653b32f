"""The fault-free plant starts, comes through its recipe, settles, breaks no limit and shows no symptom."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from homeostat.domain.diagnosis import SymptomRule
from homeostat.domain.lasting import lasting
from homeostat.domain.plant.description import Relation
from homeostat.domain.plant.limits import Limit, LimitKind
from homeostat.domain.recovery import Step
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.contract import module_file
from homeostat.evaluate.lint.deep.course import Course, told_margin
from homeostat.evaluate.lint.deep.inverted import TURN, turned_at
from homeostat.evaluate.lint.deep.resting import Rest, rest_of
from homeostat.evaluate.lint.deep.settings import of_settings
from homeostat.evaluate.lint.deep.symptoms import first_symptoms
from homeostat.evaluate.lint.finding import Finding, Place, Severity
from homeostat.guard.requests.permissives import permissive_findings
from homeostat.plants.wired.assembly import nominal

MISSED: Final = 0.9
"""Share of its settled time for which a healthy plant may miss an acceptance criterion [1]."""
ROUND: Final = 1e-6
"""A margin that is below 0 by so little is not (in the formula's unit)."""
OUTSIDE: Final = 0.01
"""Share of the time for which a true value may be outside its instrument's range [1]."""


def fault_free(bench: Bench) -> Iterator[Finding]:
    """What is wrong with the plant while nothing is wrong; each thing once, however many courses show it."""
    seen = set[str]()
    for course in _courses(bench):
        for finding in _findings(bench, course):
            if str(finding.where) not in seen:
                seen.add(str(finding.where))
                yield finding
    yield from of_settings(bench)


def _courses(bench: Bench) -> Iterator[Course]:
    bench.told("the fault-free plant")
    yield bench.quiet
    yield from bench.noisy


def _findings(bench: Bench, course: Course) -> Iterator[Finding]:
    if course.broke:
        what = f"the fault-free plant breaks: {course.broke}"
        place = Place(module_file(bench), None, "kernel")
        yield Finding(Severity.ERROR, "fault-free", place, what, "mend the equations, or the parameters in the tables")
        return
    yield from _route(bench, course)
    yield from _limits(bench, course)
    yield from _ranges(bench, course)
    yield from _states(bench, course)
    if course is bench.quiet:  # with noise, what asks for stillness is missed by a little all the time
        yield from missed_criteria(bench, course)


def _route(bench: Bench, course: Course) -> Iterator[Finding]:
    """What the recipe does by itself is done to its end."""
    steps = nominal(bench.plant)
    if len(course.states) >= len(steps):
        return
    step = steps[len(course.states)]
    at_s = course.states[-1][1] if course.states else 0.0
    if refused := _refused(bench, course, step, at_s):
        yield refused
        return
    signals = {tag: values[:, course.after(at_s)] for tag, values in course.truth.signals.items()}
    guard = step.transition.guard
    nearest = told_margin(guard, signals, guard.margins(signals, course.truth.dt_s)[0], best=True)
    what = (
        f"the fault-free plant does not come from {step.transition.source!r} to {step.target!r} "
        f"in {lasting(bench.plant.end_s)}: '{guard}' never holds, its margin is {nearest} at best"
    )
    place = bench.places.row("transitions", id=step.transition.name)
    remedy = "correct the guard, the setpoints or the model, or give the run more time (end_s)"
    yield Finding(Severity.ERROR, "fault-free", place, what, remedy)


def _refused(bench: Bench, course: Course, step: Step, at_s: float) -> Finding | None:
    """The permissive that forbids ``step`` although its guard holds; None where there is none."""
    for snapshot in course.seen:
        if snapshot.at_s <= at_s or not step.transition.guard.holds(snapshot.values):
            continue
        for found in permissive_findings(snapshot, step.commands, bench.plant.description.limits):
            if not found.satisfied:
                what = (
                    f"it forbids what the fault-free plant is due to do at {snapshot.at_s:g} s, "
                    f"{step.transition.name!r} to {step.target!r}: {found.message}"
                )
                place = bench.places.row("limits", id=found.criterion)
                remedy = "correct the permissive, or what the state is by design (setpoints.csv)"
                given = {c.tag: c.value for c in step.commands if c.value is not None}
                if turned := turned_at(bench, found.criterion, snapshot.values, given):
                    what, remedy = f"{what}, {turned}", f"{TURN}, or what the state is by design"
                return Finding(Severity.ERROR, "fault-free", place, what, remedy)
    return None


def _limits(bench: Bench, course: Course) -> Iterator[Finding]:
    for limit in bench.plant.description.limits.limits:
        if limit.kind is LimitKind.PERMISSIVE:
            continue
        outside = course.outside(limit)
        if outside.any():
            yield _violated(bench, course, limit, outside)


def _violated(bench: Bench, course: Course, limit: Limit, outside: np.ndarray) -> Finding:
    first_s = float(course.truth.times_s[np.argmax(outside)])
    starts = first_s <= course.started_s and limit.name in bench.plant.description.start_up.limits
    place = bench.places.row("start_up", limit=limit.name) if starts else bench.places.row("limits", id=limit.name)
    what = (
        f"{limit.name} does not hold in the fault-free plant: '{limit.formula}' is violated for "
        f"{lasting(course.lasts_s(outside))}, first at {lasting(first_s)}, by up to "
        f"{told_margin(limit.formula, course.truth.signals, course.margins(limit), best=False).removeprefix('-')}"
    )
    remedy = "correct the limit, the setpoints in setpoints.csv, or the model"
    return Finding(Severity.ERROR, "fault-free", place, what, remedy)


def _ranges(bench: Bench, course: Course) -> Iterator[Finding]:
    """What is truly there can be shown."""
    for signal in bench.plant.description.signals:
        tag, values = signal.tag, course.true(signal.tag.name)
        if signal.relation is not Relation.MEASURES or not np.isfinite(values).any():
            continue
        outside = (values < tag.range.low) | (values > tag.range.high)
        if outside.mean() > OUTSIDE:
            worst = values[int(np.argmax(np.maximum(tag.range.low - values, values - tag.range.high)))]
            what = (
                f"the true {tag.name!r} is outside its instrument's range {tag.range.low:g} to {tag.range.high:g} "
                f"{tag.unit} for {lasting(course.lasts_s(outside))} of the fault-free course, as far as {worst:.4g} "
                f"{tag.unit}"
            )
            place = bench.places.row("signals", tag=tag.name)
            yield Finding(Severity.ERROR, "fault-free", place, what, "correct the range, or the parameters behind it")


def _states(bench: Bench, course: Course) -> Iterator[Finding]:
    """States that are reached settle, and start-up is over in its time."""
    d = bench.plant.description
    for name, from_s, to_s in course.stays:
        state = d.machine.state(name)
        during = course.after(from_s - course.truth.dt_s) & (course.truth.times_s <= to_s)
        signals = {tag: values[:, during] for tag, values in course.truth.signals.items()}
        if not during.any() or (state.settled_when.margins(signals, course.truth.dt_s) >= 0.0).any():
            continue
        what = f"{name!r} is entered at {lasting(from_s)}, but '{state.settled_when}' holds at no moment of it"
        place = bench.places.row("states", id=name)
        yield Finding(Severity.ERROR, "fault-free", place, what, "correct settled_when, or the setpoints of the state")
    for name, longest_s in d.start_up.longest_s.items():
        if math.isfinite(course.started_s) and course.started_s > longest_s:
            what = f"start-up takes {lasting(course.started_s)}, more than start_up_s = {longest_s:g} s"
            place = bench.places.row("states", id=name)
            yield Finding(Severity.ERROR, "fault-free", place, what, "give it twice the longest fault-free start")


def missed_criteria(bench: Bench, course: Course) -> Iterator[Finding]:
    """What is asked of a recovery is what the plant does by itself while nothing is wrong.

    A batch is not judged: what it is asked for need not last.
    """
    settled = course.after(course.settled_s)
    if len(course.states) > 2 or not settled.any():  # it goes through phases after its start
        return
    for criterion in bench.plant.description.limits.criteria:
        margins = criterion.formula.margins(course.truth.signals, course.truth.dt_s)[0]
        judged = settled & (course.truth.times_s <= course.truth.times_s[-1] - criterion.formula.horizon_s)
        if not judged.any() or (missed := float(np.mean(margins[judged] < -ROUND))) <= MISSED:
            continue
        most = told_margin(criterion.formula, course.truth.signals, np.where(judged, margins, -np.inf), best=True)
        costs = "nothing is ever released" if criterion.hard else "every run pays for it"
        what = (
            f"the fault-free plant misses '{criterion.formula}' for {missed:.0%} of the time in "
            f"{course.states[-1][0]!r}, with a margin of {most} at best, so that {costs}"
        )
        place = bench.places.row("criteria", id=criterion.name)
        yield Finding(Severity.ERROR, "fault-free", place, what, "correct the formula, or the design in setpoints.csv")


def healthy_symptoms(bench: Bench) -> Iterator[Finding]:
    """Symptoms that the fault-free plant shows."""
    seen = set[str]()
    for course in bench.noisy:
        for rule, shown in first_symptoms(bench, course, course.settled_s).items():
            if shown.confirmed_s is None or rule.name in seen:
                continue
            seen.add(rule.name)
            what = (
                f"the fault-free plant shows {rule.name!r} at {lasting(shown.confirmed_s)}: its feature deviates by "
                f"{shown.largest:.3g} times the threshold, {shown.threshold:.4g}"
            )
            place = bench.places.row("symptoms", id=rule.name)
            remedy = "raise sigma, threshold or on_delay_s" + _resting(bench, rule)
            yield Finding(Severity.ERROR, "symptoms", place, what, remedy)


def _resting(bench: Bench, rule: SymptomRule) -> str:
    """What else to do about the deviation of a controller that rests, or that shares its command: it holds nothing."""
    loops = bench.plant.description.loops
    own = next((loop for loop in loops if rule.feature == f"F-{loop.name}"), None)
    if own is None:
        return ""
    others = [loop.name for loop in loops if own.manipulated_variable == loop.manipulated_variable]
    if len(others) > 1:
        return (
            f", or leave it out where {' and '.join(others)} override each other and it rests by design (omitted.csv)"
        )
    if rest_of(bench, own) is not Rest.NO:
        return f", or leave it out where {own.name} rests by design (omitted.csv)"
    return ""
