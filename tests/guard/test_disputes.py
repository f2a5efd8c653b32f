"""Disputes: a violation that a correction alone shows waits for an answer, and no longer than the tables allow."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from homeostat.domain.events.trips import TripLifted, TripLiftEnded
from homeostat.domain.plant.rules import TripRule
from homeostat.domain.plant.timing import Timing
from homeostat.domain.snapshot import Snapshot
from homeostat.record.story.plain import plainly
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


def test_a_violation_that_no_reading_shows_says_what_the_reading_is_taken_to_be() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    until_it_trips(w)
    (told,) = w.watch.judge(w.now_s + 1.0, Snapshot(w.now_s + 1.0, hot(311.0)), "running")
    assert "; 'T' reads 311 and is taken to be 316 (LIM-HOT)" in told.reason
    assert "is taken to be" in plainly(told.reason) and "LIM-HOT" in plainly(told.reason)
    (little,) = w.watch.judge(w.now_s + 2.0, Snapshot(w.now_s + 2.0, hot(308.5)), "running")
    assert "'T' reads 308.5 and is taken to be 313.5" in little.reason
    (seen,) = w.watch.judge(w.now_s + 3.0, Snapshot(w.now_s + 3.0, hot(318.0)), "running")
    assert "taken to be" not in seen.reason, "the reading shows it"


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


def test_a_carrier_at_its_very_bound_still_refutes_a_correction() -> None:
    """What a limit permits is permitted up to it: a carrier that holds by nothing holds."""
    for tx, trips in ((311.5, False), (311.6, True)):
        w = Watch(RULE)
        w.watch.correct(LOW)
        w.judge(hot(307.0, tx))
        assert (TRIPS in [w.judge(hot(311.0, tx)) for _ in range(10)]) is trips


@pytest.mark.parametrize("errors", [({},), ({"T": -1.0},)])
def test_what_was_held_back_goes_with_its_correction_whatever_the_carrier_says_then(errors: Any) -> None:
    """The sum was made by a correction that nobody makes any more, and nothing goes on with it."""
    w = Watch(RULE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert [w.judge(hot(311.0)) for _ in range(4)] == [()] * 4  # 3, 6, 9, 12 K s, held back from the third on
    w.watch.correct(errors)
    assert [w.judge(hot(311.0, HOT_BY_BALANCE)) for _ in range(10)] == [()] * 10


@pytest.mark.parametrize(("t", "error"), [(311.0, -2.5), (313.1, -1.0)])
def test_but_not_where_the_next_correction_or_the_reading_shows_a_violation_as_well(t: float, error: float) -> None:
    w = Watch(RULE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert [w.judge(hot(311.0)) for _ in range(4)] == [()] * 4
    w.watch.correct(({"T": error},))
    assert w.judge(hot(t, HOT_BY_BALANCE)) == TRIPS


def test_it_goes_with_another_correction_alone_and_not_with_one_good_reading() -> None:
    w = Watch(RULE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert [w.judge(hot(311.0)) for _ in range(4)] == [()] * 4
    assert w.judge(hot(308.0)) == () and len(w.noted) == 1, "exactly at the limit: the sum stays, and is held back"
    assert w.judge(hot(311.0, HOT_BY_BALANCE)) == TRIPS


def test_what_no_carrier_held_back_counts_under_the_next_correction_as_well() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert [w.judge(hot(311.0)) for _ in range(2)] == [()] * 2  # 3, 6 K s
    w.watch.correct(({"T": -2.0},))
    assert w.judge(hot(311.0)) == ()  # exactly at the limit
    w.watch.correct(LOW)
    assert w.judge(hot(311.0)) == TRIPS


def test_what_was_held_back_and_has_tripped_ends_with_no_correction() -> None:
    w = Watch(RULE)
    w.watch.correct(LOW)
    w.judge(hot(307.0))
    assert [w.judge(hot(311.0)) for _ in range(4)] == [()] * 4
    assert w.judge(hot(311.0, HOT_BY_BALANCE)) == TRIPS
    w.watch.correct(({},))
    assert w.judge(hot(312.0)) == TRIPS, "it is violated until its sum has come back"


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


def test_a_reading_exactly_at_the_limit_keeps_it_and_is_disputed() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    assert until_it_trips(w, 313.0) == 6 + 2  # then 5, 10 K s


def test_a_dispute_ends_where_a_fresh_correction_shows_no_violation() -> None:
    w = Watch(ALONE)
    w.watch.correct(LOW)
    assert [w.judge(hot(311.0)) for _ in range(2)] == [()] * 2
    w.watch.correct(({"T": -2.0},))  # 313 K is no violation
    assert w.judge(hot(311.0)) == ()
    assert until_it_trips(w, 312.0) == 9  # 1 K s each, as any other


def test_what_was_a_violation_before_the_correction_is_not_disputed() -> None:
    w = Watch(ALONE)
    assert w.judge(hot(313.5)) == ()
    w.watch.correct(LOW)
    assert until_it_trips(w) == 3  # 0.5 and 3, 3, 3 K s


def test_a_limit_that_the_reading_has_tripped_is_disputed_by_no_correction() -> None:
    w = Watch(ALONE)
    w.watch.correct(({"T": 9.0},))
    assert until_it_trips(w, 316.0) == 3
    w.watch.correct(LOW)
    assert [w.judge(hot(311.0)) for _ in range(12)] == [TRIPS] * 12


def test_a_sum_that_is_used_up_but_not_exceeded_is_still_held_back() -> None:
    w = Watch(RULE)
    assert [w.judge(hot(317.0)) for _ in range(2)] == [()] * 2  # 8 K s, all that is allowed
    w.watch.correct(LOW)
    assert [w.judge(hot(313.0)) for _ in range(5)] == [()] * 5


def test_a_correction_as_large_as_may_be_lifted_is_held_back() -> None:
    w = Watch(RULE)
    w.watch.correct(({"T": -10.0},))
    w.judge(hot(302.0))
    assert until_it_trips(w, 305.0) == 4 + 20 + 1  # 2, 4, 6, 8 K s, and as long as a trip may be lifted


def test_an_uncertain_step_that_comes_back_is_watched_from_where_it_began() -> None:
    """3 K over at first, and 2 K nearer within the first seconds: no time is used until it stops."""
    w = Watch(ALONE)
    w.watch.correct(LOW)
    for t in (311.0, 310.5, 310.0, 309.5, 309.0):
        assert w.judge(hot(t)) == ()
    waited = until_it_trips(w, 309.0)
    assert 6 + 8 <= waited <= 6 + 8 + 12


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("tick_s", [0.1, 60.0])
def test_a_dispute_goes_by_the_plants_ticks(tick_s: float, seed: int) -> None:
    """What a plant of another tick reads is told as that of a second is, tick by tick."""
    reads = 309.5 + np.random.default_rng(seed).normal(0.0, 2.0, 60)

    def course(tick_s: float) -> list[tuple[str, ...]]:
        rule = replace(ALONE, cusum=ALONE.cusum * tick_s, grace_s=ALONE.grace_s * tick_s)
        w = Watch(rule, timing=Timing.of(tick_s))
        w.watch.correct(LOW)
        return [w.judge(hot(float(t)), dt_s=tick_s) for t in reads]

    found = course(tick_s)
    assert found == course(1.0) and (TRIPS in found)
