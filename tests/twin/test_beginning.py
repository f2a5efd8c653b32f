"""Where a window begins: by the mean of its first readings, or by their course where they have one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.process.types import Vec
from homeostat.twin.history import NEAR, Window

ROWS = 20
NOISE = 0.03


def beginning(readings: Vec, settle_rows: int = ROWS) -> float:
    return Window(0.0, {"L": readings}, np.zeros((len(readings), 1)), settle_rows).beginning["L"]


def noise(seed: int, count: int = 60) -> Vec:
    return NOISE * np.random.default_rng(seed).standard_normal(count)


@given(st.integers(0, 10**6))
def test_what_stands_begins_at_the_mean_of_its_readings(seed: int) -> None:
    read = 9.0 + noise(seed)
    # A spurious course is rare, and leads no further than the first readings are apart.
    assert beginning(read) == pytest.approx(read[:ROWS].mean(), abs=4.0 * NOISE)
    assert beginning(np.full(ROWS, 3.5)) == 3.5


@given(st.integers(0, 10**6), st.floats(0.02, 5.0), st.sampled_from([-1.0, 1.0]))
def test_what_falls_or_rises_begins_where_it_was(seed: int, speed: float, sign: float) -> None:
    read = 9.0 + sign * speed * np.arange(60.0) + noise(seed)
    assert beginning(read) == pytest.approx(9.0, abs=5.0 * NOISE)
    assert abs(read[:ROWS].mean() - 9.0) > 5.0 * NOISE, "its mean is another"


def test_a_reactor_that_is_emptied_by_hand() -> None:
    """9.8 L, 0.055 L/s out: the mean of 20 readings is 0.52 L lower."""
    read = 9.8 - 0.055 * np.arange(60.0) + noise(1)
    assert read[:ROWS].mean() == pytest.approx(9.28, abs=0.02) and beginning(read) == pytest.approx(9.8, abs=0.03)


@given(st.integers(0, 10**6), st.integers(0, ROWS), st.floats(-50.0, 50.0))
def test_a_step_leads_nowhere_where_it_was_not(seed: int, row: int, height: float) -> None:
    read = np.where(np.arange(60) < row, 1.0, 1.0 + height) + noise(seed)
    first = read[:NEAR]
    found, mean = beginning(read), float(read[:ROWS].mean())
    assert found == mean or first.min() <= found <= first.max()
    assert row < NEAR or abs(found - 1.0) <= max(abs(mean - 1.0), 4.0 * NOISE), "no further from it than the mean is"


@pytest.mark.parametrize("rows", [1, 2, 4])
def test_few_readings_have_no_course(rows: int) -> None:
    read = np.arange(60.0)
    assert beginning(read, rows) == read[:rows].mean() and beginning(read[:rows], ROWS) == read[:rows].mean()


def test_what_is_not_a_number_stays_one() -> None:
    read = np.arange(60.0)
    read[3] = math.nan
    assert math.isnan(beginning(read))
