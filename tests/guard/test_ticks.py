"""The guard of a plant that is sampled once a minute, or ten times a second: its sums and waits go by its ticks."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.plant.timing import Timing
from homeostat.domain.recovery import Effect
from homeostat.guard.fallback.effect import EffectWatch
from homeostat.guard.pace import Pace
from homeostat.guard.settings import GuardSettings
from homeostat.guard.watch.violations import Violation
from homeostat.recovery.bounds import Budget
from tests.guard.test_trips import RULE, Watch, hot
from tests.guard.vessel import DRAIN

pytestmark = pytest.mark.quick

TICKS_S = (60.0, 0.125)


@pytest.fixture(params=TICKS_S, ids=lambda tick_s: f"{tick_s:g}s")
def tick_s(request: pytest.FixtureRequest) -> float:
    return float(request.param)


def test_a_reading_counts_for_a_tick_and_one_that_comes_late_for_five(tick_s: float) -> None:
    rule = replace(RULE, cusum=10.0 * tick_s, lift=0.0)
    each, late = (Watch(rule, timing=Timing.of(tick_s)) for _ in range(2))
    assert [each.judge(hot(315.0), dt_s=tick_s) for _ in range(5)] == [()] * 5  # 2, 4, 6, 8, 10 K ticks
    assert each.judge(hot(313.1), dt_s=tick_s) == ("LIM-HOT",)
    late.judge(hot(305.0), dt_s=tick_s)
    assert late.judge(hot(315.0), dt_s=100.0 * tick_s) == (), "10 K ticks, not 200"
    assert late.judge(hot(313.1), dt_s=tick_s) == ("LIM-HOT",)


def test_a_clock_that_stands_takes_a_tick(tick_s: float) -> None:
    watch = Watch(replace(RULE, cusum=10.0 * tick_s, lift=0.0), timing=Timing.of(tick_s))
    assert [watch.judge(hot(315.0), dt_s=0.0) for _ in range(5)] == [()] * 5
    assert watch.judge(hot(313.1), dt_s=0.0) == ("LIM-HOT",)


def test_before_a_clock_has_told_its_period_it_is_the_plants_tick(tick_s: float) -> None:
    pace = Pace(tick_s)
    pace.advance(100.0)
    pace.advance(float("nan"))
    assert pace.now_s == 100.0 + 0.5 * tick_s


def test_a_fallback_has_the_time_that_nobody_stated_as_the_plant_responds(tick_s: float) -> None:
    timing = Timing.of(tick_s)
    strategy, watch = replace(DRAIN, serves={"LIM-OTHER": Effect(1.0)}), EffectWatch((), timing)
    violation = Violation("LIM-FULL", -2.0, "L", "it is full")
    said = [watch.failed(k * tick_s, strategy, [violation]) for k in range(602)]
    assert [k for k, each in enumerate(said) if each] == [600]
    text = said[600]
    assert text is not None and f"has stood for {600 * tick_s:g} s" in text[1]


def test_a_clock_that_leaps_ends_no_period_early(tick_s: float) -> None:
    strategy = replace(DRAIN, serves={"LIM-FULL": Effect(8.0 * tick_s)})
    watch, violation = EffectWatch((strategy,), Timing.of(tick_s)), Violation("LIM-FULL", -2.0, "L", "it is full")
    assert watch.failed(0.0, strategy, [violation]) is None
    assert watch.failed(500.0 * tick_s, strategy, [violation]) is None, "five ticks of eight"


def test_waits_of_the_guard_are_longer_where_ticks_are_and_never_shorter() -> None:
    usual, slow = GuardSettings(), GuardSettings().for_ticks(60.0)
    assert (slow.write_s, slow.again_s, slow.check_age_s) == (180.0, 600.0, 1800.0)
    assert (slow.sync_s, slow.call_s, slow.order_s) == (usual.sync_s, usual.call_s, usual.order_s), "the wall clock's"
    assert usual.for_ticks(0.1) == usual


def test_recovery_keeps_some_ticks_for_a_fallback_to_act() -> None:
    usual = Budget()
    assert Budget().for_ticks(1.0) == usual
    slow, fast = usual.for_ticks(60.0), usual.for_ticks(0.1)
    assert (slow.reserve_s, fast.reserve_s) == (300.0, 0.5)
    assert (slow.answer_s, fast.answer_s) == (3600.0, 60.0)
    assert fast.latency_s == usual.latency_s == 30.0
    assert slow.latency_s == slow.diagnosis_s == slow.arming_s == slow.check_s == 300.0, "five ticks"
    assert usual.for_ticks(3600.0).latency_s == 600.0, "and no hours"
    assert Budget(latency_s=20.0).for_ticks(60.0).latency_s == 20.0, "somebody chose it"
