"""Falls: a margin that falls as no process can is not believed at once, never for long, and never where nothing else
carries the limit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.plant.rules import StartUp, TripRule
from homeostat.guard.watch.falls import BEFORE, LAGS, QUIET, Falls
from homeostat.stl.formula import parse, parse_expression
from tests.guard.test_trip_edges import _hot as parse_limit
from tests.guard.test_trips import HOT_BY_BALANCE, Watch, filling, hot
from tests.guard.vessel import TAGS

pytestmark = pytest.mark.quick

SLOW = parse_expression("0.2", TAGS)
"""0.2 K/s: what the process can do."""
RULE = TripRule("LIM-HOT", 8.0, 6.0, parse("Tx <= 311.5", TAGS), lift=10.0, lift_s=20.0, fastest=SLOW)
SETTLED = max(LAGS) + BEFORE + QUIET
TRIPS = ("LIM-HOT",)


def fell(margins: list[float], tick_s: float = 1.0) -> list[int]:
    """Ticks after the quiet stretch at which ``margins`` have fallen faster than they can."""
    falls = Falls(SLOW, tick_s)
    quiet = [falls.take(3.0, {}) for _ in range(SETTLED)]
    assert not any(quiet)
    return [k for k, margin in enumerate(margins) if falls.take(margin, {})]


def damped(size: float, tau_s: float, count: int = 20) -> list[float]:
    """A margin of 3 from which an error of ``size`` is taken that comes through a filter."""
    return [3.0 - size * (1.0 - math.exp(-(k + 1) / tau_s)) for k in range(count)]


def test_an_error_through_a_filter_is_seen_within_seconds() -> None:
    """By hand: 5 K and 3 s show 1.42, 2.43 and 3.16 K; their mean is 2.34 K, and 0.2 K/s explain 0.8 K in 4 s."""
    assert fell(damped(5.0, 3.0))[0] <= 2


def test_what_the_process_can_do_is_believed() -> None:
    assert fell([3.0 - 0.19 * (k + 1) for k in range(60)]) == []


def test_a_faster_process_is_not() -> None:
    assert fell([3.0 - 1.0 * (k + 1) for k in range(20)]) != []


def test_the_rate_is_per_second_whatever_the_tick() -> None:
    assert fell([3.0 - 0.19 * 5.0 * (k + 1) for k in range(20)], tick_s=5.0) == []
    assert fell([3.0 - 0.2 * (k + 1) for k in range(20)], tick_s=0.1) != []


@pytest.mark.parametrize(("size", "falls"), [(2.4, False), (3.4, True)])
def test_what_noise_makes_is_taken_off(size: float, falls: bool) -> None:
    """By hand: 0.5 K of scatter are 4.5 * 1.3 * 0.5 * (1/3 + 1/5)^0.5 = 2.14 K of two means; 0.8 K are the rate's."""
    watched = Falls(SLOW, 1.0)
    for k in range(SETTLED + 1):
        assert not watched.take(3.0 + (0.5 if k % 2 else -0.5), {})
    assert (True in [watched.take(3.0 - size, {}) for _ in range(8)]) is falls


def test_a_rise_is_no_fall() -> None:
    assert fell([3.0 + 5.0 for _ in range(20)]) == []


def test_nothing_is_seen_before_it_is_known_how_far_it_scatters() -> None:
    falls = Falls(SLOW, 1.0)
    assert not any(falls.take(3.0 if k < 20 else -5.0, {}) for k in range(SETTLED - 1))


@pytest.mark.parametrize("gap", [math.nan])
def test_after_a_gap_it_begins_anew(gap: float) -> None:
    assert fell([gap, *damped(5.0, 3.0)]) == []


@pytest.mark.parametrize("said", ["0.2 / 0", "T - T - 1", "Tx"])
def test_a_rate_that_cannot_be_told_doubts_nothing(said: str) -> None:
    falls = Falls(parse_expression(said, TAGS), 1.0)
    for _ in range(SETTLED):
        falls.take(3.0, {"T": 300.0})
    assert not any(falls.take(margin, {"T": 300.0}) for margin in damped(5.0, 3.0))


@given(seed=st.integers(0, 10_000), colour=st.floats(0.0, 0.4))
def test_noise_alone_hardly_ever_falls(seed: int, colour: float) -> None:
    """Some of 2000 ticks at most, as a doubt costs no more than the grace time."""
    white, error, falls = np.random.default_rng(seed).normal(0.0, 0.5, 2000), 0.0, Falls(SLOW, 1.0)
    found = 0
    for each in white.tolist():
        error = colour * error + math.sqrt(1.0 - colour**2) * each
        found += falls.take(3.0 + error, {})
    assert found <= 6


def settled(rule: TripRule) -> Watch:
    w = Watch(rule)
    for _ in range(SETTLED):
        assert w.judge(hot(310.0)) == ()
    return w


def until_it_trips(w: Watch, error: float, tx: float = 305.0) -> int:
    """Ticks after an error began that comes through a filter of 3 s."""
    reading = (313.0 - margin for margin in damped(error, 3.0, 100))
    return next(k + 1 for k, t in enumerate(reading) if w.judge(hot(t, tx)) == TRIPS)


@pytest.mark.parametrize("error", [4.0, 6.0, 12.0, 40.0])
def test_a_trip_waits_for_the_grace_time_from_the_first_violation_where_something_carries_the_limit(
    error: float,
) -> None:
    """What the reading says meanwhile is added up all the same."""
    believed = replace(RULE, fastest=None)
    first = next(k for k, margin in enumerate(damped(error, 3.0, 100), start=1) if margin < 0.0)
    at_once, waits = until_it_trips(settled(believed), error), until_it_trips(settled(RULE), error)
    assert waits == max(at_once, first + RULE.grace_s)
    assert (waits > at_once) is (error >= 6.0)


@pytest.mark.parametrize("after", [312.9, 312.0, 310.0])
def test_a_fall_that_comes_back_within_the_grace_time_leaves_nothing_behind(after: float) -> None:
    w = settled(RULE)
    assert [w.judge(hot(330.0)) for _ in range(5)] == [()] * 5
    assert [w.judge(hot(after)) for _ in range(30)] == [()] * 30


def test_what_has_come_back_is_not_added_to_what_comes_later() -> None:
    """5 ticks of 17 K are more than any sum allows; 0.1 K afterwards are not."""
    w = settled(RULE)
    assert [w.judge(hot(330.0)) for _ in range(5)] == [()] * 5
    assert w.judge(hot(313.0)) == ()
    assert [w.judge(hot(313.1)) for _ in range(20)] == [()] * 20


@pytest.mark.parametrize(("rate", "seen"), [(0.2, 1), (1.0, 2), (1.4, 3)])
def test_the_grace_time_of_a_fall_that_is_seen_late_began_with_the_violation(rate: float, seen: int) -> None:
    """By hand: of three readings one, two, three are 6 K higher; the process can do 0.6 or 3 K in 3 s, 5.6 K in 4 s."""
    falls, fast = (
        Falls(parse_expression(str(rate), TAGS), 1.0),
        replace(RULE, fastest=parse_expression(str(rate), TAGS)),
    )
    for _ in range(SETTLED):
        falls.take(3.0, {})
    assert next(k for k in range(1, 10) if falls.take(-3.0, {})) == seen
    w = settled(fast)
    assert [w.judge(hot(316.0)) for _ in range(7)] == [()] * 6 + [TRIPS]


@pytest.mark.parametrize("dt_s", [0.5, 2.0])
def test_the_grace_time_of_a_violation_counts_seconds_not_samples(dt_s: float) -> None:
    w = settled(RULE)
    found = [w.judge(hot(330.0), uncertain="T", dt_s=dt_s) for _ in range(14)]
    assert found.index(TRIPS) == 6.0 / dt_s


def test_a_violation_of_start_up_is_none_of_operation() -> None:
    w = Watch(RULE, start_up=StartUp(frozenset({"waiting"}), {"LIM-HOT": parse_limit("T <= 350")}))
    assert [w.judge(filling(t), "waiting") for t in (300.0, 353.0, 353.0)] == [()] * 3
    assert [w.judge(hot(330.0), uncertain="T") for _ in range(7)] == [()] * 6 + [TRIPS]


FALLEN = replace(RULE, fallen=parse("Tx <= 320", TAGS))
"""The other carrier says nothing against 315 K, where the one that tells a trip in operation does."""


def test_what_carries_a_limit_that_has_fallen_is_another() -> None:
    """Without it nothing carries the limit, and the fall is believed at once; until the sum is empty it goes on so."""
    assert until_it_trips(settled(RULE), 40.0, 315.0) == 1
    w = settled(FALLEN)
    for _ in range(3):
        assert w.judge(hot(320.0, 315.0)) == ()
    w.watch.correct(({"T": 10.0},))
    assert [w.judge(hot(320.0, 315.0)) for _ in range(15)] == [()] * 15
    assert w.judge(hot(320.0, 321.0)) == () and w.noted[0][1].carrier == "Tx <= 320"
    assert TRIPS in [w.judge(hot(320.0, 321.0)) for _ in range(9)]


def test_what_came_slowly_has_not_fallen() -> None:
    w = settled(FALLEN)
    rising = [310.0 + 0.1 * k for k in range(60)]
    w.watch.correct(({"T": 6.0},))
    assert TRIPS in [w.judge(hot(t, 315.0)) for t in rising]


def test_a_fall_that_is_over_leaves_the_carrier_of_operation() -> None:
    w = settled(FALLEN)
    assert [w.judge(hot(320.0, 315.0)) for _ in range(3)] == [()] * 3
    assert [w.judge(hot(310.0, 315.0)) for _ in range(60)] == [()] * 60
    w.watch.correct(({"T": 6.0},))
    assert TRIPS in [w.judge(hot(310.0 + 0.1 * k, 315.0)) for k in range(60)]


@pytest.mark.parametrize("over", [2.0, 7.0, 20.0])
def test_a_reading_that_is_held_for_uncertain_and_stays_trips_when_the_grace_time_is_over(over: float) -> None:
    w = settled(RULE)
    found = [w.judge(hot(313.0 + over), uncertain="T") for _ in range(7)]
    assert found == [()] * 6 + [TRIPS]


@pytest.mark.parametrize("rule", [TripRule("LIM-HOT", 8.0, 6.0, fastest=SLOW), RULE])
def test_nothing_waits_where_nothing_carries_it(rule: TripRule) -> None:
    tx = HOT_BY_BALANCE if rule.carrier is not None else 305.0
    believed = TripRule("LIM-HOT", 8.0, 6.0)
    assert until_it_trips(settled(rule), 6.0, tx) <= until_it_trips(settled(believed), 6.0) + 1


def test_a_reading_that_falls_again_and_again_is_no_excuse_for_ever() -> None:
    w = settled(RULE)
    readings = [310.0 + 12.0 * (k % 10 >= 3) for k in range(60)]
    assert TRIPS in [w.judge(hot(t)) for t in readings]


def test_a_diagnosis_that_comes_meanwhile_lifts_it_and_its_end_trips() -> None:
    w = settled(RULE)
    for k, margin in enumerate(damped(6.0, 3.0, 10)):
        if k == 6:
            w.watch.correct(({"T": 6.0},))
        assert w.judge(hot(313.0 - margin)) == ()
    assert until_it_trips(w, 6.0) <= 20 + 8


def test_what_is_forgotten_says_nothing_of_what_follows() -> None:
    falls = Falls(SLOW, 1.0)
    for _ in range(SETTLED):
        falls.take(3.0, {})
    falls.forget()
    assert not any(falls.take(margin, {}) for margin in damped(5.0, 3.0))
