"""Times and bounds of the trip watch, one by one: what is counted, from when, and what uses it up."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.domain.events.trips import TripLifted
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.rules import QualityRule, TripRule
from homeostat.domain.plant.timing import Timing
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.jumps import Jumps
from homeostat.guard.watch.trips import TripWatch
from homeostat.guard.watch.violations import Violation
from homeostat.stl.formula import parse, parse_expression
from tests.guard.test_falls import SETTLED
from tests.guard.test_trip_edges import ALONE, COOL, TRIPS
from tests.guard.test_trips import HOT_BY_BALANCE, LIMIT, RULE, Watch, hot
from tests.guard.vessel import RULES, TAGS

pytestmark = pytest.mark.quick

HOT_BY_8_K = ({"T": 8.0},)
"""The reading is 8 K high."""
NOBODY = math.nan
"""What nobody reads."""


def lifted() -> Watch:
    """A limit of 313 K whose reading is 320 K and 8 K high, which is known."""
    w = Watch()
    w.watch.correct(HOT_BY_8_K)
    for _ in range(4):
        assert w.judge(hot(320.0)) == ()
    assert isinstance(w.noted[-1][1], TripLifted)
    return w


# a reading


def test_a_reading_counts_for_five_ticks_at_most_however_long_nobody_looked() -> None:
    w = Watch(TripRule("LIM-HOT", 11.0, 6.0))
    w.judge(hot(310.0))
    assert w.judge(hot(315.0), dt_s=60.0) == ()  # 10 K s
    assert w.judge(hot(315.0)) == TRIPS


def test_a_sum_waits_while_nobody_sees_the_reading() -> None:
    w = Watch(ALONE)
    found = [w.judge(hot(t)) for t in (316.0, 316.0, NOBODY, NOBODY, 315.0, 313.5)]
    assert found == [()] * 5 + [TRIPS]  # 3, 6, 8, 8.5 K s


def test_a_reading_that_is_missing_uses_up_no_time_of_one_that_is_uncertain() -> None:
    w = Watch()
    found = [w.judge(hot(t), uncertain="T") for t in (NOBODY,) * 3 + (330.0,) * 7]
    assert found == [()] * 9 + [TRIPS]


def test_a_reading_that_was_missing_for_a_tick_violates_the_limit_since_before() -> None:
    w = Watch()
    found = [w.judge(hot(t), uncertain="T") for t in (330.0,) * 3 + (NOBODY,) + (330.0,) * 4]
    assert found == [()] * 7 + [TRIPS]


def test_what_is_violated_is_so_while_nobody_sees_it() -> None:
    """An explanation denies it, which nobody can check either."""
    w = Watch(ALONE)
    w.watch.correct(COOL)
    assert w.judge(hot(330.0)) == w.judge(hot(NOBODY)) == TRIPS


@pytest.mark.parametrize("small", [0.1, 0.5, 0.9])
def test_a_violation_begins_with_the_first_reading_over_the_limit_however_little(small: float) -> None:
    w = Watch()
    assert [w.judge(hot(313.0 + t)) for t in (small / 3, small / 3, small / 3)] == [()] * 3
    assert [w.judge(hot(330.0), uncertain="T") for _ in range(4)] == [()] * 3 + [TRIPS]


def test_a_grace_time_that_was_used_up_comes_back() -> None:
    w = Watch(replace(RULE, cusum=100.0))
    assert [w.judge(hot(314.0), uncertain="T") for _ in range(12)] == [()] * 12
    assert [w.judge(hot(300.0)) for _ in range(20)] == [()] * 20
    w.watch.correct(())
    found = [w.judge(hot(400.0), uncertain="T") for _ in range(7)]
    assert found == [()] * 6 + [TRIPS]


def test_what_is_right_at_the_limit_contradicts_no_carrier() -> None:
    """For a minute the carrier says that the limit is violated and the reading that it is kept, by nothing at all."""
    w = Watch()
    for _ in range(80):
        w.judge(hot(313.0, HOT_BY_BALANCE))
    found = [w.judge(hot(NOBODY, HOT_BY_BALANCE)) for _ in range(4)]
    assert TRIPS not in found[:1] and w.watch.above(Snapshot(w.now_s, hot(313.0, 300.0))) == ()


@pytest.mark.parametrize(("refuted_s", "believed"), [(59, True), (60, True), (61, False)])
def test_a_carrier_is_refuted_after_a_minute_of_readings_that_say_otherwise(refuted_s: int, believed: bool) -> None:
    """Until then it trips by its balance, 3 K s a second, where the reading is held for uncertain."""
    w = Watch(replace(RULE, cusum=1.0, grace_s=30.0))
    for _ in range(refuted_s):
        assert w.judge(hot(300.0, 314.5)) == ()
    assert (w.judge(hot(300.0, 314.5), uncertain="T") == TRIPS) is believed


def test_how_long_a_carrier_was_refuted_goes_back_as_slowly_as_it_came() -> None:
    w = Watch(replace(RULE, cusum=1.0, grace_s=30.0))
    for tx in (314.5,) * 61 + (305.0,) * 5 + (314.5,) * 6:
        assert w.judge(hot(300.0, tx)) == ()
    assert w.judge(hot(300.0, 314.5), uncertain="T") == ()


@pytest.mark.parametrize("refuted_s", [61, 200])
@pytest.mark.parametrize(("agreed_s", "believed"), [(1, False), (59, False), (60, True)])
def test_a_refuted_carrier_is_believed_again_when_it_has_agreed_for_as_long(
    refuted_s: int, agreed_s: int, believed: bool
) -> None:
    """One wild reading that violates the limit, too, does not make an instrument right that was wrong for minutes."""
    w = Watch(replace(RULE, cusum=2.0, grace_s=30.0))
    for _ in range(refuted_s):
        assert w.judge(hot(300.0, 314.5)) == ()
    for second in range(agreed_s):
        assert w.judge(hot(313.1 if second % 2 else 312.9, 311.0 if second % 2 == 0 else 314.5)) == ()
    found = [w.judge(hot(300.0, 314.5), uncertain="T") for _ in range(3)]
    assert (TRIPS in found) is believed


def test_before_anything_has_fallen_the_carrier_of_operation_counts() -> None:
    w = Watch(replace(RULE, cusum=3.0, fallen=parse("Tx <= 320", TAGS)))
    assert w.judge(hot(300.0, 315.0), uncertain="T") == TRIPS


# what carries a limit


@pytest.mark.parametrize(("t", "tx"), [(313.5, 305.0), (314.0, 311.0), (314.0, 311.5)])
def test_a_fall_by_little_and_a_carrier_at_its_bound_are_as_good_as_others(t: float, tx: float) -> None:
    w = Watch(replace(RULE, cusum=2.0, fastest=parse_expression("0.2", TAGS)))
    for _ in range(SETTLED):
        w.judge(hot(310.0, tx))
    assert [w.judge(hot(t, tx)) for _ in range(7)] == [()] * 6 + [TRIPS]


@pytest.mark.parametrize("tx", [310.6, 311.5])
def test_a_carrier_carries_up_to_its_very_bound(tx: float) -> None:
    w = Watch()
    assert [w.judge(hot(400.0, tx), uncertain="T") for _ in range(7)] == [()] * 6 + [TRIPS]


def test_time_without_a_carrier_counts_only_while_a_trip_is_lifted() -> None:
    w = Watch()
    assert [w.judge(hot(310.0, NOBODY)) for _ in range(12)] == [()] * 12
    w.watch.correct(HOT_BY_8_K)
    for _ in range(3):
        assert w.judge(hot(320.0)) == ()
    assert [w.judge(hot(320.0, NOBODY)) for _ in range(7)] == [()] * 6 + [TRIPS]


def test_a_second_lift_owes_nothing_of_what_the_carrier_said_in_the_first() -> None:
    w = lifted()
    assert [w.judge(hot(320.0, 314.0)) for _ in range(3)] == [()] * 3  # 7.5 of 8 K s
    assert [w.judge(hot(300.0)) for _ in range(5)] == [()] * 5
    w.watch.correct(HOT_BY_8_K)
    for _ in range(3):
        assert w.judge(hot(320.0, 311.5)) == ()
    assert [w.judge(hot(320.0, 312.5)) for _ in range(4)] == [()] * 4


@pytest.mark.parametrize("tick_s", [0.5, 2.0])
def test_what_a_carrier_says_counts_for_five_ticks_at_most(tick_s: float) -> None:
    """0.6 K for an hour that nobody looked is 3 ticks' worth of a kelvin."""
    w = Watch(timing=Timing(tick_s), trips={"LIM-HOT": replace(RULE, cusum=8.0, lift_s=1e6)})
    w.watch.correct(HOT_BY_8_K)
    for _ in range(20):
        assert w.judge(hot(320.0), dt_s=tick_s) == ()
    over = 6.0 / (5.0 * tick_s)
    assert w.judge(hot(320.0, 311.5 + over), dt_s=600.0) == ()
    assert w.judge(hot(320.0, 311.5 + 2.1 / tick_s), dt_s=tick_s) == TRIPS


# corrections


def test_two_corrections_within_a_tick_are_one() -> None:
    """The second says the same as the first, which was fresh."""
    w = Watch(ALONE)
    w.judge(hot(311.0))
    for _ in range(2):
        w.watch.correct(({"T": -5.0},))
    assert [w.judge(hot(311.0)) for _ in range(9)] == [()] * 8 + [TRIPS]


@pytest.mark.parametrize("near", [0, 1])
def test_what_is_disputed_is_near_by_its_readings_alone(near: int) -> None:
    w = Watch(ALONE)
    w.watch.correct(({"T": -5.0},))
    for _ in range(5):
        w.judge(hot(311.0))
    raw = Watch(ALONE)
    for _ in range(near and 3):
        raw.judge(hot(315.0))
    raw.judge(hot(313.0))
    assert w.last is not None and raw.last is not None
    assert w.watch.near(w.last) == () and len(raw.watch.near(raw.last)) == near


def test_a_sum_of_start_up_leaves_no_debt() -> None:
    """8.5 K s by the reading, which the explanation denies."""
    w = Watch(ALONE)
    w.watch.correct(COOL)
    assert w.judge(hot(321.0)) == () and w.judge(hot(313.5)) == TRIPS


@pytest.mark.parametrize(("rate", "comes_back"), [(0.0842, True), (0.0826, False)])
def test_what_would_be_back_within_a_minute_uses_no_time(rate: float, comes_back: bool) -> None:
    """5 K within 60 s are 0.0833 K/s; 20 s of grace and two of 5 K are over after 22 s."""
    w = Watch(TripRule("LIM-HOT", 8.0, 20.0))
    w.watch.correct(({"T": -5.0},))
    found = [w.judge(hot(313.0 - rate * k)) for k in range(50)]
    assert (TRIPS not in found) is comes_back


def test_what_comes_back_is_seen_through_its_noise_within_three_ticks() -> None:
    """By hand: at 0.12 K/s a lag of 3 s shows 0.034, 0.058, 0.076, 0.088 K in its first seconds, of which the first and
    the third come before 0.083 K are together; 10 s of grace less one for the first tick and these two are left.
    """
    w = Watch(TripRule("LIM-HOT", 8.0, 10.0))
    w.watch.correct(({"T": -5.0},))
    assert [w.judge(hot(313.0 - 0.12 * k)) for k in range(20)] == [()] * 20
    assert [w.judge(hot(313.0)) for _ in range(9)] == [()] * 8 + [TRIPS]


# jumps

QUALITIES = {tag: QualityRule(tag, 5.0, noise=0.0, fastest=0.3, grace_s=5.0) for tag in ("T", "Tx")}


def jumped(values: dict[str, float], correct: tuple[dict[str, float], ...] = ()) -> Violation:
    """What is said of a limit that trips at once, after both thermometers fell by 8 K, at ``values``."""
    jumps = Jumps(QUALITIES)
    rules = replace(RULES, limits=Limits((LIMIT,), ()), trips={})
    watch = TripWatch(rules, lambda event, at_s: None, jumps)
    jumps.remember({"T": -8.0, "Tx": -8.0})
    if correct:
        watch.correct(correct)
    (found,) = watch.judge(1.0, Snapshot(1.0, values), "running")
    return found


def test_what_is_violated_only_if_a_reading_had_not_jumped_is_said_so() -> None:
    found = jumped(hot(306.0))
    assert found.jumped and found.margin == -1.0
    assert found.reason.endswith("if 'T' by -8 has jumped for no reason in the process")  # and nothing of 'Tx'
    assert jumped(hot(313.0)).jumped  # it holds by nothing at all


@pytest.mark.parametrize(("t", "error"), [(313.5, 0.0), (306.0, -7.5), (313.5, -1.0)])
def test_what_the_readings_or_a_diagnosis_show_as_well_is_an_ordinary_violation(t: float, error: float) -> None:
    correct = ({"T": error}, {"T": 2.0}) if error else ()
    assert not jumped(hot(t), correct).jumped


def test_a_jump_of_what_nobody_reads_now_says_nothing() -> None:
    jumps = Jumps(QUALITIES)
    watch = TripWatch(replace(RULES, limits=Limits((LIMIT,), ()), trips={"LIM-HOT": ALONE}), lambda e, s: None, jumps)
    jumps.remember({"T": -8.0})
    found = [watch.judge(float(k), Snapshot(float(k), hot(NOBODY if k % 2 else 300.0)), "running") for k in range(9)]
    assert found == [()] * 9
