"""Stabilised Runge-Kutta: steps of many cheap stages that are stable with motions much faster than themselves.

A step of h with s stages (RKC2, of second order; Sommeijer, Shampine and Verwer 1997, J. Comput. Appl. Math. 88, 315):

    w0 = 1 + 2 / (13 s^2)     w1 = T_s'(w0) / T_s''(w0)     b_j = T_j''(w0) / T_j'(w0)^2     a_j = 1 - b_j T_j(w0)
    Y_0 = y                   Y_1 = y + b_1 w1 h f(y)
    Y_j = (1 - m_j - n_j) y + m_j Y_(j-1) + n_j Y_(j-2) + o_j h f(Y_(j-1)) - a_(j-1) o_j h f(y)
    m_j = 2 b_j w0 / b_(j-1)  n_j = -b_j / b_(j-2)          o_j = 2 b_j w1 / b_(j-1)

with Chebyshev polynomials T_j. It is stable up to 0.653 (s^2 - 1) for motions that do not swing: flows that follow
pressures, heat that follows temperatures. Ten stages reach 64.6, where ten evaluations of Runge-Kutta 4 reach 7.

Stable is not yet right: of what is fast a long step leaves a third or more. What jumps does so at the beginning of a
tick, when commands reach their actuators. Steps therefore grow through the tick: the first ones follow what is fast
until it has died out, and the last ones have what is slow to follow.

Hand check: two stages of h = 0.1 make 1 - h + h^2 / 2 = 0.905 of y' = -y, which is exp(-0.1) = 0.9048 but for 2e-4.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import Final, NamedTuple

from numpy.polynomial import chebyshev

FIRST: Final = 1.0
"""The first step of a tick, at most, in times of the fastest motion."""
GROWTH: Final = 1.5
"""How many times as long each next step is."""
MOST: Final = 50
"""Stages that a step may have."""


class Stage(NamedTuple):
    """One evaluation: what the next Y is made of."""

    fresh: float
    """1 where a step begins: what is found is its y, and the rate the first one; otherwise 0."""
    here: float
    """Share of Y_(j-1), m_j."""
    before: float
    """Share of Y_(j-2), n_j."""
    rate: float
    """Times the rate found [s]."""
    first: float
    """Times the first rate of the step [s]."""


@functools.cache
def stages_of(tick_s: float, fastest_s: float) -> tuple[Stage, ...]:
    """All evaluations of a tick, for motions that take ``fastest_s`` [s] or longer.

    ValueError where a step would have more than 50 of them.
    """
    return tuple(stage for step_s in lengths(tick_s, fastest_s) for stage in _step(step_s, _many(step_s, fastest_s)))


def lengths(tick_s: float, fastest_s: float) -> tuple[float, ...]:
    """The steps of a tick [s], each :data:`GROWTH` times as long as the one before."""
    count = max(math.ceil(math.log1p(tick_s * (GROWTH - 1.0) / (FIRST * fastest_s)) / math.log(GROWTH)), 1)
    unit = tick_s * (GROWTH - 1.0) / (GROWTH**count - 1.0)
    return tuple(unit * GROWTH**k for k in range(count))


def fastest(tick_s: float, fastest_s: float) -> float:
    """The rate [1/s] up to which every step of a tick is stable."""
    steps = lengths(tick_s, fastest_s)
    return min(_Chebyshev(_many(step_s, fastest_s)).stable / step_s for step_s in steps)


def _many(step_s: float, fastest_s: float) -> int:
    """Stages with which a step is stable."""
    count = max(math.ceil(math.sqrt(1.0 + step_s / fastest_s / 0.653)), 2)
    if count > MOST:
        raise ValueError(f"a step would have {count} stages, more than {MOST}")
    return count


def _step(step_s: float, count: int) -> Iterator[Stage]:
    numbers = _Chebyshev(count)
    a, b, w0, w1 = numbers.a, numbers.b, numbers.w0, numbers.w1
    yield Stage(1.0, 1.0, 0.0, b[1] * w1 * step_s, 0.0)
    for j in range(2, count + 1):
        own = 2.0 * b[j] * w1 / b[j - 1] * step_s
        yield Stage(0.0, 2.0 * b[j] * w0 / b[j - 1], -b[j] / b[j - 2], own, -a[j - 1] * own)


class _Chebyshev:
    """The numbers of a step with ``count`` stages."""

    def __init__(self, count: int) -> None:
        self.w0 = w0 = 1.0 + 2.0 / (13.0 * count**2)
        basis = [chebyshev.Chebyshev.basis(j) for j in range(count + 1)]
        slope = [float(each.deriv()(w0)) for each in basis]
        bend = [float(each.deriv(2)(w0)) for each in basis]
        self.w1 = slope[count] / bend[count]
        later = [bend[j] / slope[j] ** 2 for j in range(2, count + 1)]
        self.b = [later[0], later[0], *later]
        self.a = [1.0 - b * float(each(w0)) for b, each in zip(self.b, basis, strict=True)]
        self.stable = (w0 + 1.0) / self.w1
        """Rate times step up to which it is stable."""
