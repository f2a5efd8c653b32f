"""Falls: a margin that falls as no process can is not believed at once, never for long, and never where nothing else
carries the limit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.plant.rules import TripRule
from homeostat.guard.watch.falls import BEFORE, LAGS, QUIET, Falls
from homeostat.stl.formula import parse, parse_expression
from tests.guard.test_trips import HOT_BY_BALANCE, Watch, hot
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


def test_a_trip_waits_for_the_grace_time_where_something_carries_the_limit() -> None:
    """8 K s are there after 6 s; the 6 s of grace come to these."""
    believed, doubted = TripRule("LIM-HOT", 8.0, 6.0, RULE.carrier, lift=10.0, lift_s=20.0), RULE
    at_once = until_it_trips(settled(believed), 6.0)
    assert at_once + 4 <= until_it_trips(settled(doubted), 6.0) <= at_once + 6


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
