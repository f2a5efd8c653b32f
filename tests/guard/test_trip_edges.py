"""Trip limits at their edges: the first tick, the last one, the exact bound, and what a break in between changes."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.plant.limits import Limit, LimitKind, Limits
from homeostat.domain.plant.rules import StartUp, TripRule
from homeostat.domain.snapshot import Snapshot
from homeostat.stl.formula import parse
from tests.guard.test_trips import LIMIT, RULE, Watch, filling, hot
from tests.guard.vessel import TAGS, limit

TRIPS = ("LIM-HOT",)
ALONE = TripRule("LIM-HOT", 8.0, 6.0)
"""A limit that nothing carries."""
COOL = ({"T": 20.0},)
"""An explanation by which every reading here is far below the limit."""


def test_a_sum_begins_at_nothing_and_counts_from_the_first_tick() -> None:
    w = Watch(ALONE)
    w.watch.correct(COOL)
    assert w.judge(hot(321.5)) == TRIPS  # 8.5 K s by the readings, nothing by the explanation
    w = Watch()
    assert w.judge(hot(321.0)) == ()  # 8 K s is what is allowed


@pytest.mark.parametrize("before", [0, 1])
def test_the_carrier_watches_for_the_grace_time_and_no_longer(before: int) -> None:
    w = Watch()
    for _ in range(before):
        w.judge(hot(300.0))
    assert [w.judge(hot(400.0), uncertain="T") for _ in range(7)] == [()] * 6 + [TRIPS]


def test_a_limit_without_a_rule_trips_at_the_first_tick_without_a_reading() -> None:
    w = Watch(None)
    assert w.judge(hot(math.nan)) == TRIPS


def test_before_the_first_tick_the_limits_of_operation_count() -> None:
    w = Watch(start_up=StartUp(frozenset({"waiting"}), {"LIM-HOT": _hot("T <= 350")}))
    assert [v.limit for v in w.watch.above(Snapshot(1.0, hot(314.0)))] == ["LIM-HOT"]


def test_a_correction_that_is_no_number_does_not_blind_the_carrier() -> None:
    w = Watch()
    w.watch.correct(({"T": 8.0, "Tx": math.nan},))
    assert [w.judge(hot(320.0)) for _ in range(4)] == [()] * 4


def test_a_clock_that_runs_back_counts_as_one_that_stands() -> None:
    w = Watch(ALONE)
    w.judge(hot(300.0))
    assert [w.judge(hot(315.0), dt_s=dt_s) for dt_s in (0.0, -50.0, 0.0, -1.0, 0.0)] == [()] * 4 + [TRIPS]


def test_a_short_tick_counts_for_its_own_time() -> None:
    w = Watch(ALONE)
    w.judge(hot(300.0))
    assert [w.judge(hot(323.0), dt_s=0.25) for _ in range(4)] == [()] * 3 + [TRIPS]


def test_what_is_near_by_the_explanation_alone_is_near() -> None:
    w = Watch()
    w.watch.correct(({"T": -6.0},))
    w.judge(hot(300.0))
    for _ in range(5):
        w.judge(hot(308.0))  # 1 K over the limit by the explanation
    assert w.last is not None and [v.limit for v in w.watch.near(w.last)] == ["LIM-HOT"]


@pytest.mark.parametrize(("t", "above"), [(312.5, 0), (313.0, 0), (313.01, 1)])
def test_a_reading_at_its_limit_is_not_above_it(t: float, above: int) -> None:
    w = Watch()
    w.judge(hot(t))
    assert w.last is not None and len(w.watch.above(w.last)) == above


def test_start_up_forgets_only_what_was_judged_by_another_limit() -> None:
    start = StartUp(frozenset({"waiting"}), {"LIM-HOT": _hot("T <= 350")})
    other = limit("LIM-OTHER", LimitKind.TRIP_LIMIT, "Tx <= 300", hard=True)
    w = Watch(TripRule("LIM-OTHER", 0.5, 6.0), limits=Limits((LIMIT, other), ()), start_up=start)
    warm = filling(300.0) | {"Tx": 300.25}
    assert [w.judge(warm, s) for s in ("waiting", "running", "running")] == [(), (), ("LIM-OTHER",)]


@pytest.mark.parametrize("explained", [False, True])
def test_a_sum_of_operation_begins_at_nothing_when_start_up_is_over(explained: bool) -> None:
    w = Watch(ALONE, start_up=StartUp(frozenset({"waiting"}), {"LIM-HOT": _hot("T <= 350")}))
    w.watch.correct(({"T": -100.0},) if explained else COOL)
    w.judge(filling(200.0), "waiting")
    w.judge(filling(257.0 if explained else 357.0), "waiting")
    t = 221.0 if explained else 321.0
    assert w.judge(hot(t)) == ()  # 8 K s by the reading, or by the explanation
    assert w.judge(hot(t + 0.01 - 8.0)) == TRIPS


def test_the_sum_of_the_readings_counts_in_full_after_start_up() -> None:
    w = Watch(ALONE, start_up=StartUp(frozenset({"waiting"}), {"LIM-HOT": _hot("T <= 350")}))
    w.judge(filling(300.0), "waiting")
    w.watch.correct(COOL)
    assert w.judge(hot(321.5)) == TRIPS
    w = Watch(ALONE, start_up=StartUp(frozenset({"waiting"}), {"LIM-HOT": _hot("T <= 350")}))
    w.watch.correct(({"T": -100.0},))
    w.judge(filling(200.0), "waiting")
    assert w.judge(hot(221.5)) == TRIPS


@pytest.mark.parametrize(("text", "found"), [("true", ()), ("false", TRIPS)])
def test_a_limit_that_needs_no_reading_is_judged_without_one(text: str, found: tuple[str, ...]) -> None:
    never = Limit("LIM-HOT", LimitKind.TRIP_LIMIT, parse(text, TAGS), True, "", "")
    assert Watch(ALONE, limits=Limits((never,), ())).judge(None) == found


def test_the_worst_explanation_trips() -> None:
    w = Watch(ALONE)
    w.watch.correct(({"T": 0.1}, {"T": -12.0}))
    w.judge(hot(300.0))
    assert [w.judge(hot(305.0)) for _ in range(3)] == [(), (), TRIPS]
    violation = w.watch.judge(5.0, Snapshot(5.0, hot(305.0)), "running")[0]
    assert violation.margin == -4.0


def test_a_violation_lasts_while_anything_is_left_of_its_sum() -> None:
    w = Watch(ALONE)
    w.judge(hot(323.0))  # 10 K s
    assert w.judge(hot(303.5)) == TRIPS  # half a K s is left
    assert w.judge(hot(312.5)) == ()


def test_a_violation_lasts_while_nobody_sees_the_reading() -> None:
    w = Watch(ALONE)
    assert w.judge(hot(math.nan)) == ()
    assert w.judge(hot(323.0)) == w.judge(hot(math.nan)) == TRIPS
    (violation,) = w.watch.judge(w.now_s + 1.0, Snapshot(w.now_s + 1.0, hot(math.nan)), "running")
    assert violation.limit == "LIM-HOT" and math.isnan(violation.margin) and violation.unit == "K"
    assert violation.reason == "What LIM-HOT protects: 'T <= 313' cannot be judged now (LIM-HOT)"


def test_a_violation_ends_where_a_diagnosis_may_lift_it() -> None:
    w = Watch()
    assert [w.judge(hot(320.0)) for _ in range(2)] == [(), TRIPS]
    w.watch.correct(({"T": 8.0},))
    found = [w.judge(hot(320.0)) for _ in range(7)]
    assert found == [TRIPS] * 5 + [()] * 2  # the sum by the explanation falls from 14 to 8 K s
    assert w.judge(hot(312.0)) == ()


@pytest.mark.parametrize(("error", "tx", "lifts"), [
    (7.0, 305.0, True), (3.0, 305.0, True), (2.9, 305.0, False), (7.5, 305.0, True),
    (8.0, 311.5, True), (8.0, 311.0, True), (8.0, 311.6, False), (8.0, 312.4, False),
])  # fmt: skip
def test_lifting_holds_at_its_exact_bounds(error: float, tx: float, lifts: bool) -> None:
    """Corrected by 3 K the reading violates the limit by 4 K, which two seconds bring to the 8 K s that are allowed."""
    w = Watch()
    w.watch.correct(({"T": error},))
    found = [w.judge(hot(320.0, tx)) for _ in range(2)]
    assert (found[-1] == ()) is lifts and bool(w.noted) is lifts


def test_a_lifting_after_a_break_ends_that_much_sooner() -> None:
    w = Watch()
    w.watch.correct(({"T": 8.0},))
    for _ in range(12):
        w.judge(hot(320.0))
    for _ in range(30):
        w.judge(hot(305.0))
    for _ in range(2):
        w.judge(hot(320.0))
    at_s, event = w.noted[-1]
    assert len(w.noted) == 3 and event.until_s == at_s + RULE.lift_s - 11.0


def test_blindness_comes_back_no_faster_than_it_went() -> None:
    w = Watch(ALONE)
    for _ in range(5):
        assert [w.judge(hot(math.nan)) for _ in range(6)] == [()] * 6
        assert [w.judge(hot(300.0)) for _ in range(6)] == [()] * 6
    w = Watch(ALONE)
    assert [w.judge(hot(math.nan)) for _ in range(50)] == [()] * 6 + [TRIPS] * 44
    assert [w.judge(hot(300.0)) for _ in range(6)] == [()] * 6
    assert w.judge(hot(math.nan)) == ()  # a long blindness is not held against it for ever


@pytest.mark.parametrize("how", ["missing", "uncertain"])
@pytest.mark.parametrize(("out_of", "within_s"), [(10, 20), (3, 30), (2, 10)])
def test_a_reading_that_flaps_puts_no_trip_off(how: str, out_of: int, within_s: int) -> None:
    w = Watch()  # what carries the limit sees nothing
    for n in range(within_s):
        good = n % out_of == 0
        t = 317.0 if good or how == "uncertain" else math.nan
        if w.judge(hot(t, 300.0), uncertain="" if good or how == "missing" else "T"):
            return
    pytest.fail(f"no trip within {within_s} s")


def test_what_carries_a_limit_takes_nothing_back_of_what_its_readings_have_shown() -> None:
    w = Watch()
    assert [w.judge(hot(315.0)) for _ in range(4)] == [()] * 4  # 8 K s
    assert [w.judge(hot(300.0, 250.0), uncertain="T") for _ in range(4)] == [()] * 4
    assert w.judge(hot(313.1)) == TRIPS


def test_without_an_allowance_the_sum_stops_one_above() -> None:
    w = Watch(None)
    assert w.judge(hot(400.0)) == TRIPS
    assert w.judge(hot(312.0)) == ()


@pytest.mark.parametrize(("t", "said"), [
    (313.0, "was violated and holds by no more than 0 K"), (312.5, "was violated and holds by no more than 0.5 K"),
    (313.5, "is violated by 0.5 K"),
])  # fmt: skip
def test_the_sentence_says_on_which_side_the_reading_is(t: float, said: str) -> None:
    w = Watch(ALONE)
    w.judge(hot(400.0))
    (violation,) = w.watch.judge(2.0, Snapshot(2.0, hot(t)), "running")
    assert violation.reason == f"What LIM-HOT protects: 'T <= 313' {said} (LIM-HOT)"


def _hot(text: str) -> Limit:
    return limit("LIM-HOT", LimitKind.TRIP_LIMIT, text, hard=True)


def test_a_trip_that_is_lifted_stays_so_while_nobody_sees_the_reading() -> None:
    w = Watch()
    w.watch.correct(({"T": 8.0},))
    for _ in range(8):
        w.judge(hot(320.0))
    assert [w.judge(hot(math.nan)) for _ in range(7)] == [()] * 6 + [TRIPS]


def test_a_reading_that_comes_back_while_its_trip_is_lifted_trips_nothing() -> None:
    w = Watch()
    w.watch.correct(({"T": 8.0},))
    for _ in range(12):
        w.judge(hot(320.0))
    assert [w.judge(hot(300.0), uncertain="T") for _ in range(5)] == [()] * 5  # a step that nobody believes yet
    assert [w.judge(hot(300.0)) for _ in range(5)] == [()] * 5
