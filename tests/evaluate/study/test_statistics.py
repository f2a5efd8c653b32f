"""Statistics against published examples and by hand, and what holds for any values."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.evaluate.report.statistics import (
    Estimate,
    Interval,
    Rate,
    Spread,
    bootstrap,
    estimate,
    holm,
    mcnemar,
    pooled,
    quantile,
    rate,
    spread,
    wilson,
)

COUNTS = st.integers(1, 400).flatmap(lambda of: st.tuples(st.integers(0, of), st.just(of)))
VALUES = st.lists(st.floats(-1e3, 1e3, allow_nan=False).map(lambda v: round(v, 3)), min_size=2, max_size=15)


@pytest.mark.parametrize(
    ("count", "of", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_gives_the_examples_of_newcombe_1998(count: int, of: int, low: float, high: float) -> None:
    ends = wilson(count, of)
    assert (ends.low, ends.high) == pytest.approx((low, high), abs=5e-5)


def test_wilson_of_ten_in_ten_by_hand() -> None:
    z2 = 1.959963984540054**2
    assert wilson(10, 10).low == pytest.approx(10 / (10 + z2))
    assert wilson(10, 10).high == pytest.approx(1.0)


def test_nothing_is_known_of_a_rate_without_runs() -> None:
    assert wilson(0, 0) == Interval(0.0, 1.0)
    assert rate([]) is None
    assert pooled(0, 0) is None


@pytest.mark.parametrize(("count", "of"), [(-1, 3), (4, 3)])
def test_a_count_outside_its_range_is_refused(count: int, of: int) -> None:
    with pytest.raises(ValueError, match=rf"{count} of {of} is no rate; count must lie in 0 to {of}"):
        wilson(count, of)


@given(COUNTS)
def test_the_interval_contains_the_rate(counts: tuple[int, int]) -> None:
    count, of = counts
    ends = wilson(count, of)
    assert 0.0 <= ends.low <= count / of + 1e-12
    assert count / of - 1e-12 <= ends.high <= 1.0


@given(COUNTS)
def test_the_interval_of_failures_mirrors_that_of_successes(counts: tuple[int, int]) -> None:
    count, of = counts
    assert wilson(of - count, of).low == pytest.approx(1.0 - wilson(count, of).high, abs=1e-9)


def test_mcnemar_by_hand() -> None:
    assert mcnemar(0, 0) == 1.0
    assert mcnemar(0, 5) == pytest.approx(2 / 2**5)
    assert mcnemar(1, 9) == pytest.approx(2 * (1 + 10) / 2**10)
    assert mcnemar(7, 7) == 1.0


@given(st.integers(0, 60), st.integers(0, 60))
def test_mcnemar_does_not_care_which_one_is_first(a: int, b: int) -> None:
    assert mcnemar(a, b) == mcnemar(b, a)
    assert 0.0 < mcnemar(a, b) <= 1.0


def test_holm_by_hand() -> None:
    assert holm([]) == []
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.9]) == [1.0, 1.0]


@given(st.lists(st.floats(0.0, 1.0), max_size=8))
def test_adjusting_never_makes_a_difference_clearer(p_values: list[float]) -> None:
    adjusted = holm(p_values)
    assert all(p <= q <= 1.0 for p, q in zip(p_values, adjusted, strict=True))
    assert sorted(adjusted) == [q for _, q in sorted(zip(p_values, adjusted, strict=True))]


@given(VALUES)
def test_a_bootstrap_lies_among_the_values_and_follows_from_them(values: list[float]) -> None:
    ends = bootstrap(values)
    assert ends is not None
    assert min(values) - 1e-9 <= ends.low <= ends.high <= max(values) + 1e-9
    assert ends == bootstrap(list(reversed(values)))


def test_equal_differences_have_an_interval_without_width() -> None:
    assert bootstrap([2.5] * 10) == Interval(2.5, 2.5)
    assert bootstrap([0.0, 0.0]) == Interval(0.0, 0.0)
    assert bootstrap([1.0]) is None


def test_a_bootstrap_of_many_values_is_about_the_normal_interval() -> None:
    values = [math.sin(7.3 * i) for i in range(400)]
    mean = sum(values) / 400
    half = 1.96 * math.sqrt(sum((v - mean) ** 2 for v in values) / 399 / 400)
    ends = bootstrap(values)
    assert ends is not None
    assert (ends.low, ends.high) == pytest.approx((mean - half, mean + half), abs=0.15 * half)


def test_estimates_and_spreads_by_hand() -> None:
    assert estimate([]) is None
    assert estimate([3.0]) == Estimate(3.0, None)
    assert spread([]) is None
    assert spread([1.0, 9.0, 2.0]) == Spread(2.0, 9.0, 3)
    assert spread([1.0, 9.0, 2.0], more_is_better=True) == Spread(2.0, 1.0, 3)
    assert quantile([0.0, 1.0, 2.0, 3.0], 0.25) == 0.75
    assert pooled(3, 4) == Rate(3, 4, None)
