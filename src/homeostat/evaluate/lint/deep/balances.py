"""Do mass and energy close? What the tables say a balance gains and loses is held against what the model stores.

A feature with an accumulation is such a balance. Without noise and with the best estimates of the parameters it closes,
but for what the tables leave out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from homeostat.domain.diagnosis import Feature
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.course import Course
from homeostat.evaluate.lint.finding import Finding, Severity, amount
from homeostat.process.types import Vec
from homeostat.stl import tree
from homeostat.stl.formula import Expression
from homeostat.stl.text import render

OPEN: Final = 0.02
"""Share of what goes in and out that a balance may leave unexplained [1]."""


def balances(bench: Bench) -> Iterator[Finding]:
    """Every balance that does not close on the fault-free course."""
    bench.told("balances")
    for feature in bench.plant.description.features:
        if feature.accumulation is not None:
            yield from _closes(bench, feature)


def _closes(bench: Bench, feature: Feature) -> Iterator[Finding]:
    course = bench.quiet
    from_s = course.settled_s if course.settled_s < course.truth.times_s[-1] else 0.0
    late = course.after(from_s)
    assert feature.accumulation is not None
    stored = _values(course, feature.accumulation.root)[late]
    rate = _values(course, feature.expression.root)[late]
    dt_s = course.truth.dt_s
    window = max(int(feature.window_s / dt_s), 1)
    if stored.size <= window or not np.isfinite(stored).all() or not np.isfinite(rate).all():
        return
    left = float(np.abs(stored[window:] - stored[:-window] - dt_s * _sums(rate, window)).mean())
    allowed = _allowed(bench, feature, dt_s * _sums(_gross(course, feature.expression.root)[late], window))
    if left > allowed:
        what = (
            f"'{feature.expression}' does not bring what '{feature.accumulation}' gains: in {window * dt_s:g} s of "
            f"a healthy course {amount(left, feature.unit)} are left over on the mean, more than "
            f"{amount(allowed, feature.unit)}"
        )
        remedy = "correct the balance in the table, or the equation of the model that loses it"
        yield Finding(Severity.ERROR, "balances", bench.places.row("features", id=feature.name), what, remedy)


def _allowed(bench: Bench, feature: Feature, moved: Vec) -> float:
    """What may be left over: half of what a symptom counts; where there is none a small share of what is ``moved``."""
    rules = [rule.threshold for rule in bench.plant.description.symptom_rules if rule.feature == feature.name]
    return 0.5 * min(rules) if rules else OPEN * float(moved.mean())


def _values(course: Course, node: tree.Arithmetic) -> Vec:
    """True values of a term, shape (times,)."""
    times = course.truth.times_s.size
    found: Vec = np.broadcast_to(Expression(render(node), node).evaluate(course.truth.signals), (1, times))[0]
    return found


def _gross(course: Course, node: tree.Arithmetic) -> Vec:
    """What all its parts move, whether in or out, shape (times,)."""
    if isinstance(node, tree.Binary) and node.operator in "+-":
        return _gross(course, node.left) + _gross(course, node.right)
    return np.abs(_values(course, node))


def _sums(values: Vec, window: int) -> Vec:
    """Sums of ``window`` values after each one but the last ones."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray(total[window + 1 :] - total[1:-window])
