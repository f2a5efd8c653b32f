"""The measurements of the guard's page, in small: what they call wrong is not there."""

from __future__ import annotations

import pytest

from benchmarks.guard import bad_day, kills, trips
from benchmarks.guard.store import Sizes

PLANTS = ("cstr", "mixing_module")


@pytest.mark.slow
@pytest.mark.parametrize("plant", ["cstr", pytest.param("mixing_module", marks=pytest.mark.wide)])
def test_three_bad_hours_miss_no_reaction(plant: str) -> None:
    found = bad_day.measure(plant, Sizes(days_s=10_800.0))
    assert found["missed"] == found["unexpected"] == found["not_back"] == found["raised"] == []
    assert found["expected"] >= 16 and found["ticks"] == 10_800


@pytest.mark.parametrize("plant", ["mixing_module", pytest.param("cstr", marks=pytest.mark.wide)])
def test_deaths_leave_nothing_repeated_lost_or_unsafe(plant: str) -> None:
    lives = [kills.kill(plant, seed) for seed in range(8)]
    assert [w for life in lives for w in life.wrong] == []
    assert sum(len(life.places) for life in lives) >= 8


def test_a_step_of_3_k_trips_within_10_s_and_noise_below_the_limit_does_not() -> None:
    found = trips.measure(Sizes(trips=3, quiet=1))
    assert all(s["max_s"] <= 10.0 and not s["early"] for s in found["steps"] if s["over_k"] == 3.0)
    assert found["quiet"]["tripped"] == []
