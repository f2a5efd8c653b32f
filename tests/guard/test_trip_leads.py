"""Leads: a limit that trips before it is violated, so that it is kept although stopping takes time."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.rules import StartUp, TripRule
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.effect import EffectWatch
from tests.guard.test_trips import LIMIT, RULE, Watch, filling, hot
from tests.guard.vessel import CLOSE, limit

pytestmark = pytest.mark.quick

AT_ONCE = TripRule("LIM-HOT", 0.0, 6.0)
LEADING = Limits((replace(LIMIT, lead=3.0),), ())
PROTECTS = "What LIM-HOT protects: "


def test_without_a_lead_it_trips_at_the_limit_and_with_one_so_much_sooner() -> None:
    assert [Watch(AT_ONCE).judge(hot(t)) for t in (312.9, 313.1)] == [(), ("LIM-HOT",)]
    assert [Watch(AT_ONCE, limits=LEADING).judge(hot(t)) for t in (310.0, 310.1)] == [(), ("LIM-HOT",)]


def test_a_violation_tells_the_margin_that_is_left_and_the_lead() -> None:
    w = Watch(AT_ONCE, limits=LEADING)
    (found,) = w.watch.judge(1.0, Snapshot(1.0, hot(311.5)), "running")
    assert found.margin == pytest.approx(1.5)
    said = "'T <= 313' holds by no more than 1.5 K; it trips 3 K before it is violated (LIM-HOT)"
    assert found.reason == PROTECTS + said
    (found,) = w.watch.judge(1.5, Snapshot(1.5, hot(313.0)), "running")
    assert found.margin == 0.0 and "holds by no more than 0 K; it trips 3 K before" in found.reason
    (found,) = w.watch.judge(2.0, Snapshot(2.0, hot(314.0)), "running")
    assert found.margin == pytest.approx(-1.0) and found.reason == PROTECTS + "'T <= 313' is violated by 1 K (LIM-HOT)"


def test_the_sum_counts_from_where_it_trips() -> None:
    w = Watch(RULE, limits=LEADING)  # 8 K s
    assert [w.judge(hot(312.0)) for _ in range(5)] == [(), (), (), (), ("LIM-HOT",)]


def test_it_lasts_until_the_reading_is_back_behind_the_lead() -> None:
    w = Watch(AT_ONCE, limits=LEADING)
    assert w.judge(hot(310.5)) == ("LIM-HOT",)
    assert w.judge(hot(310.2)) == ("LIM-HOT",)
    assert w.judge(hot(309.0)) == () and w.judge(hot(309.9)) == ()


def test_a_correction_and_a_release_meet_the_lead_as_well() -> None:
    w = Watch(AT_ONCE, limits=LEADING)
    w.judge(hot(305.0))
    w.watch.correct(({"T": -6.0},))
    reading = Snapshot(2.0, hot(305.0))
    assert [v.limit for v in w.watch.above(reading)] == ["LIM-HOT"]
    assert [v.limit for v in Watch(AT_ONCE, limits=LEADING).watch.above(Snapshot(1.0, hot(310.5)))] == ["LIM-HOT"]
    assert Watch(AT_ONCE, limits=LEADING).watch.above(Snapshot(1.0, hot(309.5))) == ()


def test_start_up_has_limits_of_its_own_and_no_lead() -> None:
    start = StartUp(frozenset({"waiting"}), {"LIM-HOT": limit("LIM-HOT", LIMIT.kind, "T <= 350", hard=True)})
    w = Watch(AT_ONCE, limits=LEADING, start_up=start)
    assert w.judge(filling(349.0), state="waiting") == ()


def test_a_fallback_that_keeps_the_limit_inside_its_lead_helps() -> None:
    w = Watch(AT_ONCE, limits=LEADING)
    effects, stands = EffectWatch((CLOSE,)), replace(CLOSE, serves={})
    for second in range(1, 700):
        now_s = float(second)
        found = w.watch.judge(now_s, Snapshot(now_s, hot(312.0)), "running")
        assert found and effects.failed(now_s, stands, found) is None


@pytest.mark.parametrize("lead", [-1.0, math.nan, math.inf])
def test_a_lead_that_is_none_cannot_be_built(lead: float) -> None:
    with pytest.raises(ValueError, match=r"limit 'LIM-HOT': lead .* must be finite and >= 0 K"):
        replace(LIMIT, lead=lead)


def test_limits_without_leads_are_watched_as_they_are() -> None:
    plain = Limits((LIMIT,), ())
    assert plain.watched is plain
    assert [x.formula.text for x in LEADING.watched.hard] == ["T <= 310"]
    assert LEADING.watched.watched is not LEADING and LEADING.watched.hard[0].lead == 0.0


def test_a_correction_of_one_reading_leaves_the_other_readings_of_a_limit_as_they_are() -> None:
    both = limit("LIM-HOT", LIMIT.kind, "T - Tx <= 8", hard=True)
    w = Watch(AT_ONCE, limits=Limits((both,), ()))
    w.judge(hot(312.0, tx=305.0))
    assert w.watch.above(Snapshot(1.0, hot(312.0, tx=305.0))) == ()
    w.watch.correct(({"T": -1.5},))
    assert [v.margin for v in w.watch.above(Snapshot(1.0, hot(312.0, tx=305.0)))] == [pytest.approx(-0.5)]
