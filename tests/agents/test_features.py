"""Features on line: a filtered residual, and a balance over a window."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.domain.diagnosis import Feature
from homeostat.domain.snapshot import Snapshot
from homeostat.stl.formula import parse_expression


def residual(filter_s: float = 0.0) -> FeatureFilter:
    return FeatureFilter(Feature("F", parse_expression("a - b"), None, 0.0, filter_s, "K", "C"))


def balance(window_s: float, filter_s: float = 0.0) -> FeatureFilter:
    return FeatureFilter(
        Feature("F", parse_expression("a - b"), parse_expression("stored"), window_s, filter_s, "L", "C")
    )


def shown(feature: FeatureFilter, *rows: tuple[float, ...]) -> list[float | None]:
    names = ("a", "b", "stored")
    return [feature.update(Snapshot(float(k), dict(zip(names, row, strict=False)))) for k, row in enumerate(rows)]


def test_without_filter_a_residual_is_itself() -> None:
    assert shown(residual(), (3.0, 1.0), (5.0, 7.0)) == [2.0, -2.0]


def test_the_filter_starts_at_the_first_value_and_follows_exponentially() -> None:
    """After n seconds of a unit step, 1 - exp(-n / filter)."""
    values = shown(residual(4.0), (0.0, 0.0), *[(1.0, 0.0)] * 8)
    assert values == pytest.approx([0.0, *(1.0 - math.exp(-n / 4.0) for n in range(1, 9))])


def test_a_balance_says_nothing_until_its_window_is_full() -> None:
    values = shown(balance(3.0), *[(1.0, 1.0, 5.0)] * 5)
    assert values == [None, None, None, 0.0, 0.0]


@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), min_size=6, max_size=20))
def test_a_balance_that_closes_is_zero(flows: list[tuple[float, float]]) -> None:
    """What is stored grows by what came in a second before: nothing is unexplained."""
    stored, rows = 10.0, []
    for inflow, outflow in flows:
        rows.append((inflow, outflow, stored))
        stored += inflow - outflow
    assert [v for v in shown(balance(4.0), *rows) if v is not None] == pytest.approx([0.0] * (len(rows) - 4), abs=1e-9)


@pytest.mark.parametrize("loss", [0.05, -0.05])
def test_what_is_lost_in_a_window_is_the_feature(loss: float) -> None:
    rows = [(0.3, 0.3, 10.0 - loss * k) for k in range(30)]
    assert shown(balance(20.0), *rows)[-1] == pytest.approx(-20.0 * loss)


def test_an_old_loss_leaves_the_window() -> None:
    rows = [(0.0, 0.0, 10.0)] * 5 + [(0.0, 0.0, 9.0)] * 10
    values = shown(balance(4.0), *rows)
    assert -1.0 in values and values[-1] == 0.0


@pytest.mark.parametrize("gap", [(math.nan, 1.0), (1.0, math.nan)])
def test_a_reading_that_says_nothing_makes_the_feature_unknown_and_leaves_no_trace(gap: tuple[float, float]) -> None:
    assert shown(residual(), (1.0, 0.5), gap, (1.0, 0.5)) == [0.5, None, 0.5]


@pytest.mark.parametrize("gap", [(math.nan, 0.1, 10.4), (0.2, 0.1, math.nan)])
def test_a_balance_goes_on_after_a_gap(gap: tuple[float, float, float]) -> None:
    rows = [(0.2, 0.1, 10.0 + 0.1 * k) for k in range(20)]
    rows[4] = gap
    values = shown(balance(3.0), *rows)
    assert [k for k, value in enumerate(values) if value is None] == [0, 1, 2, 4]
    assert [v for v in values if v is not None] == pytest.approx([0.0] * 16, abs=1e-9)


@pytest.mark.parametrize("wild", [math.inf, -math.inf, 3.4e38, -1e15])
@pytest.mark.parametrize("column", range(3))
def test_one_wild_reading_is_unknown_and_leaves_nothing_behind(wild: float, column: int) -> None:
    """An instrument that shows the largest of numbers once: a leak that begins later is seen all the same."""
    rows = [(0.3, 0.3, 10.0 - 0.05 * max(k - 60, 0)) for k in range(120)]
    rows[30] = tuple(wild if k == column else value for k, value in enumerate(rows[30]))  # type: ignore[assignment]
    assert shown(balance(20.0, 5.0), *rows)[-1] == pytest.approx(-1.0, abs=1e-3)
    found = shown(residual(5.0), *rows)
    assert found[-1] == pytest.approx(0.0) and (found[30] is None) is (column < 2)
