"""The guard's own time: it goes on whatever the clock says, and never faster than the clock for long."""

from __future__ import annotations

import math
import sys
from typing import Any

import pytest

from homeostat.guard.pace import Pace
from tests.guard.vessel import World, running

NAN, INF = math.nan, math.inf


def times(*told: Any) -> list[float]:
    """The guard's time after each tick [s]."""
    pace, found = Pace(), []
    for now_s in told:
        pace.advance(now_s)
        found.append(pace.now_s)
    return found


def believed(*told: Any) -> list[bool]:
    """Whether there was nothing wrong with the clock, by tick."""
    pace = Pace()
    return [not pace.advance(now_s) for now_s in told]


def test_a_clock_that_goes_is_believed_from_wherever_it_begins() -> None:
    assert times(500.0, 501.0, 502.5, 503) == [500.0, 501.0, 502.5, 503.0]
    assert times(-7.0, -6.0) == [-7.0, -6.0] and all(believed(-7.0, -6.0))
    assert times(sys.float_info.max) == [sys.float_info.max]


@pytest.mark.parametrize("told", [2.0, 1.0, NAN, INF, -INF, None, "noon", 10**400, -(10**400)])
def test_where_the_clock_says_nothing_new_half_a_period_passes(told: Any) -> None:
    assert times(0.0, 2.0, told, told) == [0.0, 2.0, 3.0, 4.0]
    assert believed(0.0, 2.0, told) == [True, True, False]


def test_before_the_clock_has_said_anything_time_begins_at_0_and_half_a_second_passes() -> None:
    assert times(NAN, NAN, NAN, 4.0) == [0.0, 0.5, 1.0, 4.0]
    assert times(3.0, 3.0, 3.0) == [3.0, 3.5, 4.0]


def test_a_clock_that_begins_late_has_told_no_period_yet() -> None:
    assert times(NAN, 5000.0, NAN, NAN, 5002.0) == [0.0, 5000.0, 5000.5, 5001.0, 5002.0]


def test_ten_periods_are_believed_at_once_and_no_more() -> None:
    assert times(0.0, 1.0, 11.0) == [0.0, 1.0, 11.0]
    assert times(0.0, 1.0, 11.1) == [0.0, 1.0, 2.0] and believed(0.0, 1.0, 11.1)[-1] is False
    assert times(0.0, 0.5, 5.75, 1.5) == [0.0, 0.5, 1.0, 1.5]


def test_a_leap_is_believed_once_the_clock_has_gone_on_from_there() -> None:
    assert times(0.0, 1.0, 500.0, 501.0, 502.0) == [0.0, 1.0, 2.0, 501.0, 502.0]
    assert times(0.0, 1.0, 500.0, 500.0, 501.0) == [0.0, 1.0, 2.0, 3.0, 501.0]
    assert times(0.0, 1.0, 500.0, 499.0, 500.0) == [0.0, 1.0, 2.0, 3.0, 500.0]
    assert times(0.0, 1.0, 500.0, NAN, 501.0) == [0.0, 1.0, 2.0, 2.5, 3.5], "it leaps once more"
    assert times(0.0, 1.0, 500.0, 2.5, 501.0) == [0.0, 1.0, 2.0, 2.5, 3.5], "and here as well"


def test_a_clock_that_has_become_slower_is_believed_from_its_second_tick_on() -> None:
    assert believed(0.0, 1.0, 21.0, 41.0, 61.0, 81.0) == [True, True, False, True, True, True]


@pytest.mark.parametrize("ahead", [0.05, 0.45])
def test_a_clock_that_was_caught_up_is_believed_whatever_its_distance_was(ahead: float) -> None:
    goes = [float(k) for k in range(4)]
    again = [2.0 + ahead + k for k in range(12)]
    told = [*goes, 3.0, 3.0, 3.0, *again]
    assert all(believed(*told)[-6:]) and times(*told)[-1] == told[-1]


def test_what_a_clock_says_that_was_not_believed_is_no_period() -> None:
    assert times(0.0, 1.0, 12.0, 12.0, 13.0) == [0.0, 1.0, 2.0, 12.0, 13.0]
    assert times(0.0, 1.0, 12.0, 11.5, 12.5) == [0.0, 1.0, 2.0, 11.5, 12.5]
    assert believed(0.0, 1.0, NAN, 2.0, 500.0)[-1] is False, "a clock that came back tells no period"


def test_what_is_wrong_with_the_clock_is_told_with_both_times() -> None:
    pace = Pace()
    pace.advance(1.0)
    assert pace.advance(0.5) == "the clock says 0.5 s after 1 s"
    assert pace.advance("noon") == "the clock says 'noon' s after 1.5 s"  # type: ignore[arg-type]


def test_a_number_that_is_too_large_for_a_time_ends_no_supervision() -> None:
    world = World()
    world.tick(3)
    world.seen.append(world.guard.tick(10**400, world.vessel.sample()))
    assert "clock" in world.alarms and world.seen[-1].now_s == 3.5
    world.tick(2)
    assert "clock" not in world.alarms


def test_one_leap_of_the_clock_trips_nothing_and_is_caught_up_at_once() -> None:
    world = running()
    sample = world.vessel.sample()
    world.guard.tick(sample.at_s + 60.0, sample)
    assert "clock" in world.alarms
    seen = world.tick(30)
    assert world.guard.latched is None and seen.now_s == world.vessel.now_s and "clock" not in world.alarms


def test_a_clock_that_goes_on_from_where_it_leapt_to_is_believed() -> None:
    world = running()
    world.vessel.now_s += 600.0  # the machine slept
    world.tick(3)
    assert world.seen[-1].now_s == world.vessel.now_s and world.guard.latched is None


def test_a_clock_that_has_leapt_and_then_stood_is_believed_and_its_period_is_what_it_was() -> None:
    told = (0.0, 1.0, 2.0, 12.5, 12.5, 13.5, 14.5, 14.5)
    assert believed(*told) == [True, True, True, False, True, True, True, False]
    assert times(*told) == [0.0, 1.0, 2.0, 3.0, 12.5, 13.5, 14.5, 15.0]
