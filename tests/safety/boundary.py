"""The attack that every check must survive: values dense around its limit and sparse everywhere else.

A test class inherits `BoundaryAttack` and says what the limit is, which side is allowed, and how to ask the check.
"""

from __future__ import annotations

import math
import sys
from fractions import Fraction

import pytest

SMALLEST = 5e-324
LARGEST = sys.float_info.max
STEPS = (1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 10.0)
ULPS = 4


def around(limit: float) -> tuple[float, ...]:
    """The limit, its next floating-point neighbours on both sides, and values at growing distances from it."""
    values = [limit]
    for direction in (-math.inf, math.inf):
        value = limit
        for _ in range(ULPS):
            value = math.nextafter(value, direction)
            values.append(value)
    values += [limit + sign * step * max(abs(limit), 1.0) for step in STEPS for sign in (-1.0, 1.0)]
    return tuple(values)


FAR = (0.0, -0.0, SMALLEST, -SMALLEST, 1e-308, -1e-308, 1.0, -1.0, 1e6, -1e6, 1e308, -1e308, LARGEST, -LARGEST)
NOT_FINITE = (math.nan, math.inf, -math.inf)


class BoundaryAttack:
    """Inherit; give ``limit``, ``at_most``, `allows` and, where a check has one, ``slack``."""

    limit: float
    """The last value that is allowed."""
    at_most: bool
    """Whether values up to the limit are allowed (True) or values from it on."""
    slack: float = 0.0
    """What the check forgives, in the unit of the limit."""
    lowest: float = -math.inf
    """Values below can not be asked about."""

    def allows(self, value: float) -> bool:
        """Whether the check lets ``value`` pass."""
        raise NotImplementedError

    def expected(self, value: float) -> bool:
        """The truth, in exact arithmetic."""
        beyond = Fraction(value) - Fraction(self.limit)
        return (beyond if self.at_most else -beyond) <= Fraction(self.slack)

    def test_every_value_is_judged_exactly(self) -> None:
        edges = (
            [self.limit] if not self.slack else [self.limit, self.limit + (self.slack if self.at_most else -self.slack)]
        )
        values = [v for edge in edges for v in around(edge)] + list(FAR)
        wrong = [v for v in values if v >= self.lowest and self.allows(v) is not self.expected(v)]
        assert wrong == []

    def test_the_attack_reaches_both_sides(self) -> None:
        judged = {self.expected(v) for v in (*around(self.limit), *FAR) if v >= self.lowest}
        assert judged == {True, False}

    @pytest.mark.parametrize("value", NOT_FINITE)
    def test_what_is_not_finite_does_not_pass(self, value: float) -> None:
        assert self.allows(value) is False
