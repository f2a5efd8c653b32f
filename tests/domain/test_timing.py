"""A plant's own time: whole ticks, and times that are as much longer as it is slower."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.plant.timing import REFERENCE, Timing

TICKS_S = st.sampled_from((0.001, 0.1, 0.125, 0.5, 1.0, 2.0, 60.0, 64.0, 3600.0))


@given(TICKS_S, st.integers(0, 10_000_000))
def test_a_time_after_some_ticks_is_that_many_again(tick_s: float, ticks: int) -> None:
    timing = Timing.of(tick_s)
    assert timing.ticks(timing.at_s(ticks)) == timing.whole_ticks(timing.at_s(ticks)) == ticks


@given(TICKS_S, st.floats(1.0, 1e5), st.floats(0.01, 1e6))
def test_what_nobody_states_is_in_whole_ticks_and_never_nothing(tick_s: float, time_s: float, reset_s: float) -> None:
    timing = Timing.of(tick_s, (reset_s,))
    found = timing.time_s(time_s)
    assert found >= 0.999 * tick_s and timing.at_s(timing.ticks(found)) == found
    assert abs(found - max(time_s * timing.stretch, tick_s)) <= 0.5 * tick_s + 1e-6 * found


@given(TICKS_S, st.floats(0.01, 1e6))
def test_a_plant_responds_in_some_hundred_ticks_at_least(tick_s: float, reset_s: float) -> None:
    assert Timing.of(tick_s, (reset_s,)).response_s == max(250.0 * tick_s, reset_s)
    assert Timing.of(tick_s, (reset_s,), 77.0).response_s == 77.0, "unless somebody says otherwise"


@given(st.floats(0.0, 1e9))
def test_the_reference_keeps_whole_seconds_as_they_are(seconds: float) -> None:
    assert REFERENCE.time_s(float(round(seconds))) == round(seconds)


def test_never_and_at_once_are_so_for_every_plant() -> None:
    slow = Timing.of(60.0)
    assert math.isinf(slow.time_s(math.inf)) and slow.time_s(0.0) == 0.0


@pytest.mark.parametrize(("tick_s", "told"), [(60.0, "2040"), (1.0, "2035"), (0.1, "2035.0"), (0.01, "2035.00")])
def test_people_are_told_no_more_digits_than_ticks_have(tick_s: float, told: str) -> None:
    assert Timing.of(tick_s).told(float(told)) == told
