"""Certificates: bounds of a violation's probability that hold at every number of draws at once.

Under a probability r of a violation the ratio of a mixture of binomial likelihoods to that of r itself,

    M_n(r) = B(a + k, b + n - k) / B(a, b) / (r^k (1 - r)^(n - k)),

is a martingale with mean 1, so that it ever exceeds 1 / alpha with probability alpha at most (Ville, 1939; Robbins,
1970, for mixtures). Those r with M_n(r) < 1 / alpha therefore hold the true one with confidence 1 - alpha at every n
at once, and drawing may stop as soon as they suffice. The mixture is Beta(1/2, 1/required): most of it lies below
what is required.

Hand check: 1 % at 95 % takes 299 draws without a violation where their number is fixed, ln(0.05) / ln(0.99); here 376.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from homeostat.agents.no_worse import worse
from homeostat.agents.reliance import Bench
from homeostat.domain.plant.limits import Limit
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Rollout
from homeostat.process.types import Flags
from homeostat.twin.twin import Interruption

_SHAPE = 0.5
"""First parameter of the mixture; the second one is 1 / required."""
_HALVINGS = 60
"""Steps of a bisection: as exact as a float."""


def interval(draws: int, violations: int, level: float, required: float) -> tuple[float, float]:
    """Lower and upper bound of the probability of a violation [1], valid at every number of draws at once."""
    if not 0 <= violations <= draws:
        raise ValueError(f"{violations} violations in {draws} draws; there are 0 to {draws}")
    if draws == 0:
        return 0.0, 1.0
    k, n, b = violations, draws, 1.0 / required
    mixed = _log_beta(_SHAPE + k, b + n - k) - _log_beta(_SHAPE, b)
    most = math.log(1.0 / (1.0 - level))

    def inside(r: float) -> bool:
        likelihood = (k * math.log(r) if k else 0.0) + ((n - k) * math.log1p(-r) if n > k else 0.0)
        return mixed - likelihood < most

    share = k / n
    low = 0.0 if k == 0 else _edge(inside, share, 0.0)
    high = 1.0 if k == n else _edge(inside, share, 1.0)
    return low, high


def _edge(inside: Callable[[float], bool], within: float, without: float) -> float:
    """Where ``inside`` ends between a value ``within`` and one ``without``."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (within + without)
        if 0.0 < middle < 1.0 and inside(middle):
            within = middle
        else:
            without = middle
    return without


def _log_beta(a: float, b: float) -> float:
    return math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)


@dataclass(frozen=True, slots=True)
class Course:
    """What is commanded where something is done, or left alone."""

    actions: ActionSet
    """At once."""
    ended: Interruption | None = None
    """What ends it; None where it is to last."""
    beside: ActionSet | None = None
    """The fallback, where it violates a limit as well: only what does worse than it counts then."""


def counted(course: Course, rollout: Rollout, by: Bench) -> Flags:
    """Members of the ``rollout`` of a ``course`` that count as violations, shape (members,)."""
    if course.beside is None:
        return violated(rollout, by.limits.watched.hard)
    outside = violated(rollout, by.limits.hard)
    if not outside.any():
        return outside
    return outside & worse(rollout, by.roll_out(course.beside, None), by.limits, by.scales, by.tick_s)


def violated(rollout: Rollout, limits: Iterable[Limit]) -> Flags:
    """Which members violate one of ``limits`` at any time, or leave it undecided, shape (members,)."""
    found = np.zeros(len(rollout.weights), dtype=np.bool_)
    for limit in limits:
        margins = np.atleast_2d(limit.formula.margins(rollout.trajectory.signals, rollout.trajectory.dt_s))
        found |= ~(margins >= 0.0).all(axis=1)
    return found
