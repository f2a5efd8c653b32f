"""Trends keep every peak, and JSON every number that a browser can read."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from homeostat.console.readings import MOST, MOST_VALUES, Gathered, Readings, ReadingsError, thinned
from homeostat.console.text import to_json
from homeostat.domain.mode import Mode
from homeostat.domain.snapshot import Snapshot
from homeostat.record.directory import TRAJECTORY

NUMBERS = st.floats(-1e6, 1e6) | st.just(math.nan)


@given(arrays.arrays(np.float64, st.integers(1, 300), elements=NUMBERS), st.integers(1, 40))
def test_thinning_keeps_ends_and_peaks_and_is_short(values: np.ndarray, width: int) -> None:
    times = np.arange(values.size, dtype=np.float64)
    kept = thinned(times, [values], width)
    assert kept[0] == 0 and kept[-1] == values.size - 1 and (np.diff(kept) > 0).all()
    assert kept.size <= 4 * width
    if np.isfinite(values).any():
        assert np.nanmin(values[kept]) == np.nanmin(values) and np.nanmax(values[kept]) == np.nanmax(values)


def test_a_day_of_readings_is_thinned_to_what_a_screen_shows() -> None:
    times = np.arange(86_400, dtype=np.float64)
    series = [np.sin(times / 900.0 + k) for k in range(5)]
    kept = thinned(times, series, 800)
    assert 800 <= kept.size <= 800 * (2 + 2 * 5)


def test_the_reading_at_a_moment_is_the_last_one_before_it() -> None:
    readings = Readings(np.array([1.0, 2.0, 3.0]), {"T": np.array([10.0, 20.0, 30.0])})
    assert readings.at(2.9) == (2.0, {"T": 20.0}) and readings.at(0.5) == (0.5, {})
    assert readings.at(99.0) == (3.0, {"T": 30.0}) and readings.usual("T", slice(None)) is None


def test_a_file_that_is_no_trajectory_is_told(tmp_path: Path) -> None:
    assert Readings.of(tmp_path) is None
    (tmp_path / TRAJECTORY).write_bytes(b"PAR1 this is none")
    with pytest.raises(ReadingsError, match="is no trajectory"):
        Readings.of(tmp_path)


def test_json_has_no_number_that_a_browser_refuses() -> None:
    told = to_json({"a": math.nan, "b": (math.inf, 1.0), "c": Mode.OBSERVE, "d": "</script>\u2028"})
    assert json.loads(told) == {"a": None, "b": [None, 1.0], "c": "observe", "d": "</script>\u2028"} and told.isascii()


def test_a_plant_of_many_tags_takes_no_more_memory_than_one_of_few() -> None:
    names = [f"T{k}" for k in range(99)]
    gathered = Gathered(names, most_values=100 * 40)
    for second in range(200):
        gathered(Snapshot(float(second), dict.fromkeys(names, float(second))))
    readings = gathered.readings()
    assert readings is not None and 20 <= readings.times_s.size <= 40 and readings.at(199.0)[1]["T98"] == 199.0
    assert MOST * 150 <= MOST_VALUES, "plants of 150 tags are shown as long as others"
