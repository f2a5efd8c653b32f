"""Certificates: bounds of a violation's probability that hold whenever drawing stops."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.certificates import interval, violated
from homeostat.domain.plant.limits import Limits
from tests.safety.world import HOT, MEMBERS, rollout


def test_the_number_of_draws_without_a_violation_is_that_of_the_docstring() -> None:
    assert interval(376, 0, 0.95, 0.01)[1] <= 0.01 < interval(375, 0, 0.95, 0.01)[1]
    fixed = math.log(0.05) / math.log(0.99)
    assert fixed < 299 < 376, "what may be stopped at any time costs more than a fixed number"


@given(st.integers(1, 2000), st.floats(0.0, 1.0), st.sampled_from([0.9, 0.95, 0.99]), st.sampled_from([0.01, 0.1]))
def test_the_share_that_was_seen_lies_inside(draws: int, share: float, level: float, required: float) -> None:
    violations = round(share * draws)
    low, high = interval(draws, violations, level, required)
    assert 0.0 <= low <= violations / draws <= high <= 1.0
    assert interval(draws, violations, min(level + 0.009, 0.999), required)[1] >= high - 1e-12


@given(st.integers(0, 500))
def test_more_violations_never_lower_the_bound(draws: int) -> None:
    bounds = [interval(draws, k, 0.95, 0.01)[1] for k in range(0, draws + 1, max(draws // 10, 1))]
    assert bounds == sorted(bounds)


def test_nothing_drawn_bounds_nothing_and_nonsense_is_refused() -> None:
    assert interval(0, 0, 0.95, 0.01) == (0.0, 1.0)
    with pytest.raises(ValueError, match="3 violations in 2 draws"):
        interval(2, 3, 0.95, 0.01)


@pytest.mark.parametrize("risk", [0.003, 0.01, 0.05])
def test_the_bound_holds_at_the_stop_that_flatters_it_most(risk: float) -> None:
    """Whoever stops as soon as the bound lies below the truth finds such a time in 5 % of the cases at most."""
    chance, wrong, runs = np.random.default_rng(7), 0, 300
    for _ in range(runs):
        seen = np.cumsum(chance.random(1024) < risk)
        wrong += any(interval(n, int(seen[n - 1]), 0.95, 0.01)[1] < risk for n in range(32, 1025, 32))
    assert wrong / runs <= 0.05 + 2.0 * math.sqrt(0.05 * 0.95 / runs)


def test_a_member_that_violates_or_cannot_be_judged_counts_once() -> None:
    limits = Limits((HOT,), ()).hard
    assert not violated(rollout(), limits).any()
    hot = violated(rollout(at=(1, 2), T=1000.0), limits)
    assert hot.tolist() == [k == 1 for k in range(MEMBERS)]
    unknown = violated(rollout(at=(0, 0), T=math.nan), limits)
    assert unknown.tolist() == [k == 0 for k in range(MEMBERS)]
