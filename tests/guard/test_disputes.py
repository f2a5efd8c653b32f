"""Disputes: a violation that a correction alone shows waits for an answer, and no longer than the tables allow."""

from __future__ import annotations

import pytest

from homeostat.domain.events.trips import TripLifted, TripLiftEnded
from homeostat.domain.plant.rules import TripRule
from tests.guard.test_trips import HOT_BY_BALANCE, RULE, Watch, hot

pytestmark = pytest.mark.quick

ALONE = TripRule("LIM-HOT", 8.0, 6.0)
"""A limit that nothing carries; 6 s of grace."""
TRIPS = ("LIM-HOT",)
LOW = ({"T": -5.0},)
"""The reading is 5 K low."""


def until_it_trips(w: Watch, t: float = 311.0, tx: float = 305.0, most: int = 60) -> int:
    """Ticks until the reading ``t`` trips."""
    return next(k for k in range(1, most) if w.judge(hot(t, tx)) == TRIPS)


def test_a_violation_that_comes_with_a_correction_waits_for_the_grace_time() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    assert until_it_trips(w) == 6 + 3  # then 3, 6, 9 K s


def test_while_it_is_disputed_a_release_may_be_written() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    for _ in range(6):
        w.judge(hot(311.0))
        assert w.last is not None and w.watch.near(w.last) == w.watch.above(w.last) == ()
    w.judge(hot(311.0))
    assert [v.limit for v in w.watch.above(w.last)] == ["LIM-HOT"]


def test_saying_it_again_puts_the_trip_off_no_further() -> None:
    w = Watch(ALONE)
    found = []
    for k in range(9):
        w.watch.correct(({"T": -5.0 - 0.01 * k},))
        found.append(w.judge(hot(311.0)))
    assert found == [()] * 8 + [TRIPS]


def test_one_that_develops_under_a_correction_that_stands_trips_as_any_other() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert until_it_trips(w) == 3


def test_a_correction_that_is_repeated_is_not_fresh() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    w.watch.correct(LOW)
    assert until_it_trips(w) == 3


def test_what_comes_back_uses_no_time_and_a_wild_reading_ends_nothing() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    for k in range(20):
        assert w.judge(hot(307.5 if k == 9 else 311.0 - 0.15 * k)) == ()
    assert w.judge(hot(308.0)) == ()


def test_what_comes_back_and_stays_above_trips_after_the_grace_time() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    for k in range(10):
        assert w.judge(hot(311.0 - 0.1 * k)) == ()
    assert 6 <= until_it_trips(w, 310.1) <= 20


def test_a_reading_that_violates_the_limit_is_never_disputed() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    assert until_it_trips(w, 314.0) == 2  # 6 K s each by the correction


def test_a_dispute_ends_where_the_reading_violates_the_limit() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    assert [w.judge(hot(t)) for t in (311.0, 311.0, 314.0, 314.0)] == [(), (), (), TRIPS]


@pytest.mark.parametrize(("uncertain", "ticks"), [("T", 9), ("", 3)])
def test_a_correction_no_longer_fits_a_reading_that_stepped(uncertain: str, ticks: int) -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    found = [w.judge(hot(311.0), uncertain=uncertain) for _ in range(ticks)]
    assert found == [()] * (ticks - 1) + [TRIPS]


def test_the_time_comes_back_no_faster_than_it_was_used() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    for _ in range(4):
        w.judge(hot(311.0))
    w.watch.correct(({},))
    w.judge(hot(311.0))
    w.watch.correct(LOW)
    assert until_it_trips(w) == 3 + 3  # 3 s of the grace time are used up


def test_reading_and_carrier_together_hold_back_what_a_correction_says() -> None:
    """The error has ended: 307 K became 311 K, and the balance says that it is no 316 K."""
    w = Watch(RULE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert [w.judge(hot(311.0)) for _ in range(10)] == [()] * 10
    ((at_s, told),) = w.noted
    assert isinstance(told, TripLifted) and (at_s, told.until_s) == (4.0, 24.0)
    assert w.last is not None and w.watch.near(w.last) == w.watch.above(w.last) == ()
    w.watch.correct(({},))
    for _ in range(10):
        assert w.judge(hot(311.0)) == ()
    assert isinstance(w.noted[-1][1], TripLiftEnded)


def test_but_no_longer_than_a_trip_may_be_lifted() -> None:
    w = Watch(RULE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert until_it_trips(w) == 3 + 20


@pytest.mark.parametrize(("t", "error", "tx"), [(311.0, -5.0, HOT_BY_BALANCE), (305.0, -11.0, 305.0)])
def test_nothing_is_held_back_by_a_balance_that_agrees_or_where_the_error_is_large(
    t: float, error: float, tx: float
) -> None:
    w = Watch(RULE)
    w.watch.correct(({"T": error},))
    w.judge(hot(t - 10.0, tx))
    assert until_it_trips(w, t, tx) == 3


def test_a_reading_over_the_limit_is_held_back_by_no_carrier() -> None:
    w = Watch(RULE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert [w.judge(hot(t)) for t in (311.0, 311.0, 311.0, 311.0)] == [()] * 4
    assert w.judge(hot(313.5)) == TRIPS


def test_what_has_tripped_is_held_back_and_disputed_no_more() -> None:
    w = Watch(RULE)
    assert until_it_trips(w, 315.0) == 5
    w.watch.correct(LOW)
    assert [w.judge(hot(t)) for t in (309.0, 311.0, 311.0, 311.0, 311.0)] == [TRIPS] * 5
    assert w.noted == []
