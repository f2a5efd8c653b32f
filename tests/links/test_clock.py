"""How much process time passes while agents think."""

from __future__ import annotations

import math
import time

import pytest

from homeostat.links.clock import WALL_LIMIT_S, DeclaredClock, ThinkingClock


def think(seconds: float) -> float:
    """Think for about ``seconds``; the wall-clock time that passed in truth [s]."""
    begun = time.monotonic()
    time.sleep(seconds)
    return time.monotonic() - begun


@pytest.mark.parametrize("scale", [0.5, 1.0, 20.0])
def test_thinking_takes_wall_clock_time_times_the_scale(scale: float) -> None:
    clock = ThinkingClock(scale)
    begun = time.monotonic()
    clock.start()
    took = think(0.02)
    first = clock.collect_s()
    between = time.monotonic()
    took_more = think(0.01)
    clock.stop()
    second = clock.collect_s()
    assert scale * took <= first <= scale * (between - begun)
    assert scale * took_more <= second
    assert first + second <= scale * (time.monotonic() - begun)
    assert first + second == pytest.approx(scale * clock.total_s)


def test_what_was_collected_is_not_owed_again() -> None:
    clock = ThinkingClock(1000.0)
    clock.start()
    think(0.005)
    clock.stop()
    assert clock.collect_s() >= 5.0
    assert clock.collect_s() == 0.0


def test_nothing_is_owed_outside_thinking() -> None:
    clock = ThinkingClock(1000.0)
    assert clock.collect_s() == 0.0
    clock.start()
    clock.stop()
    clock.collect_s()
    think(0.005)
    assert clock.collect_s() == 0.0
    clock.stop()
    assert clock.collect_s() == 0.0


def test_scale_zero_stops_the_plant_and_still_tells_the_time() -> None:
    clock = ThinkingClock(0.0)
    clock.start()
    took = think(0.01)
    clock.stop()
    assert clock.collect_s() == 0.0 and clock.total_s >= took


def test_starting_again_loses_nothing() -> None:
    clock = ThinkingClock(1.0)
    clock.start()
    took = think(0.01)
    clock.start()
    clock.stop()
    assert clock.collect_s() >= took


@pytest.mark.parametrize("cost_s", [0.0, 0.25, 1.0, 7.5])
def test_a_declared_stretch_costs_the_same_however_long_it_takes(cost_s: float) -> None:
    clock = DeclaredClock(cost_s)
    for pause in (0.0, 0.003):
        clock.start()
        assert clock.collect_s() == cost_s, "the cost is owed at once"
        think(pause)
        clock.stop()
        assert clock.collect_s() == 0.0
    assert clock.total_s >= 0.003


def test_declared_stretches_add_up() -> None:
    clock = DeclaredClock(1.5)
    for _ in range(4):
        clock.start()
        clock.stop()
    assert clock.collect_s() == 6.0


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_a_clock_that_runs_backwards_or_away_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="must be finite and >= 0"):
        ThinkingClock(value)
    with pytest.raises(ValueError, match="must be finite and >= 0"):
        DeclaredClock(value)


def test_declared_thinking_is_cut_off_by_its_wall_limit_and_never_before_its_process_time() -> None:
    assert DeclaredClock().wall_s(5.0) == WALL_LIMIT_S
    clock = DeclaredClock(1.0, wall_limit_s=20.0)
    assert clock.wall_s(5.0) == 20.0 and clock.wall_s(30.0) == 30.0


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_wall_limit_is_a_time(value: float) -> None:
    with pytest.raises(ValueError, match="must be finite and > 0 s"):
        DeclaredClock(wall_limit_s=value)
