"""A fault-free course with some numbers of the tables changed: what holds no setpoint there, or moves all the time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from homeostat.domain.plant.description import ControlLoop, Relation
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course, Setting, run
from homeostat.evaluate.lint.deep.resting import LATE, SCALES, Rest, by_hand, last_of, rest_of
from homeostat.evaluate.lint.finding import Place
from homeostat.evaluate.lint.own_code import written

SWINGS: Final = 0.05
"""Share of its range by which an output may swing at the end of a course without noise [1]."""


class Restless(NamedTuple):
    """A loop that does not hold what it should."""

    loop: ControlLoop
    off: bool
    """Whether what it holds is off its setpoint."""
    swings: bool
    """Whether what it moves does not stand still."""


def with_factors(bench: Bench, factors: Mapping[str, float]) -> Course:
    """The fault-free course without noise, with the parameters called so times so much; made once."""

    def make() -> Course:
        bench.told("what other numbers would do")
        values = bench.nominal.copy()
        for symbol, factor in factors.items():
            values[bench.plant.model.parameters.index(symbol)] *= factor
        return run(bench.plant, Setting(values))

    return bench.kept(f"with {sorted(factors.items())}", make)


def restless(bench: Bench, course: Course) -> tuple[Restless, ...]:
    """Every loop that does not hold at the end of ``course``, of those that should; none where it broke.

    Of several that move the same command one has to hold.
    """
    if course.broke:
        return ()
    every = [each for loop in bench.plant.description.loops if (each := _state_of(course, loop)) is not None]
    found = [each for each in every if each.swings or (each.off and not _relieved(every, each.loop))]
    return tuple(each for each in found if not _excused(bench, each.loop))


def inner_of(bench: Bench, loop: ControlLoop) -> ControlLoop | None:
    """The loop whose setpoint ``loop`` moves; None where it moves an actuator."""
    return next((each for each in bench.plant.description.loops if each.setpoint == loop.manipulated_variable), None)


def outer_of(bench: Bench, loop: ControlLoop) -> ControlLoop | None:
    """The loop that moves the setpoint of ``loop``; None where that is given."""
    return next((each for each in bench.plant.description.loops if each.manipulated_variable == loop.setpoint), None)


def stated_action(bench: Bench, loop: ControlLoop) -> Place:
    """Where the action of ``loop`` is stated: the row of its gain where that is negative, else its line in the code."""
    symbols = [symbol for symbol in (loop.gain, loop.reset) if symbol in bench.plant.model.parameters]
    negative = [s for s in symbols if bench.nominal[bench.plant.model.parameters.index(s)] < 0.0]
    if negative:
        return bench.places.row("parameters", symbol=negative[0])
    return written(bench.plant.files, [loop.name]) or bench.places.row("loops", id=loop.name)


def _excused(bench: Bench, loop: ControlLoop) -> bool:
    if bench.quiet.broke:
        return False
    return by_hand(bench, loop) or rest_of(bench, loop) is not Rest.NO


def _relieved(every: Sequence[Restless], loop: ControlLoop) -> bool:
    """Whether another loop that moves the same command holds what it should."""
    moves = loop.manipulated_variable
    return any(each.loop != loop and each.loop.manipulated_variable == moves and not each.off for each in every)


def _state_of(course: Course, loop: ControlLoop) -> Restless | None:
    d, last = course.plant.description, last_of(course, loop)
    if last is None:
        return None
    error, moved = last
    pv, output = d.tag(loop.process_variable), d.tag(loop.manipulated_variable)
    if not np.isfinite(moved).all():  # the setpoint of another loop, which reports how far it is off
        moved = _asked(course, loop)
    swing = float(np.ptp(moved)) if np.isfinite(moved).all() and moved.size else 0.0
    off = abs(float(error.mean())) > SCALES * pv.scale
    return Restless(loop, off, swing > SWINGS * output.range.span)


def _asked(course: Course, loop: ControlLoop) -> np.ndarray:
    """What an outer loop asks of the inner one at the end of a course."""
    d, late = course.plant.description, course.after((1.0 - LATE) * course.truth.times_s[-1])
    inner = next((each for each in d.loops if each.setpoint == loop.manipulated_variable), None)
    if inner is None:
        return np.full(int(late.sum()), np.nan)
    reported = [s.tag.name for s in d.signals if s.relation is Relation.REPORTS and s.component == inner.controller]
    if not reported:
        return np.full(int(late.sum()), np.nan)
    return np.asarray((course.true(inner.process_variable) - course.true(reported[0]))[late])
