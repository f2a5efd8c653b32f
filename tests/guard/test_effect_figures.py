"""The effect of a strategy in figures: when a period ends, what of it is known, what rises, and what is said."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.recovery import Effect
from homeostat.guard.fallback.effect import EffectWatch
from homeostat.guard.watch.violations import Violation
from tests.guard.vessel import DRAIN

NAN = math.nan


def follow(
    margins: Sequence[float], effect: Effect, times: Sequence[float] | None = None
) -> list[tuple[str, str] | None]:
    """What is said after each margin of one limit, one per second unless the ``times`` are given."""
    strategy = replace(DRAIN, serves={"LIM-FULL": effect})
    watch = EffectWatch((strategy,))
    return [
        watch.failed(now_s, strategy, [Violation("LIM-FULL", m, "L", "it is full")])
        for now_s, m in zip(times or range(100, 100 + len(margins)), margins, strict=True)
    ]


def test_a_period_ends_with_the_time_of_the_table_and_the_next_one_begins() -> None:
    said = follow([-2.0] * 14, Effect(5.0))
    assert [n for n, s in enumerate(said) if s] == [5, 11]
    text = "'drain' has stood for 5 s and does not help: the margin, -2 L on average, does not rise: it is full"
    assert said[5] == ("LIM-FULL", text)


def test_the_mean_of_a_period_is_that_of_its_own_readings() -> None:
    said = follow([-8.0, -2.0, -2.0, -3.0, -3.0, -3.0, -5.0], Effect(2.0))
    assert "-4 L on average" in str(said[2]) and "-3 L on average" in str(said[5])


@pytest.mark.parametrize(("rest", "helps"), [(2.0, True), (1.999, False), (0.0, False)])
def test_a_limit_may_rest_as_far_outside_as_the_table_says(rest: float, helps: bool) -> None:
    assert (follow([-2.0] * 6, Effect(5.0, rest=rest))[-1] is None) is helps


def test_a_limit_that_is_inside_on_average_is_helped() -> None:
    assert follow([0.0] * 6, Effect(5.0))[-1] is None
    assert follow([-1e-3] * 6, Effect(5.0))[-1] is not None


@pytest.mark.parametrize(
    "times",
    [
        [0, 1, 2, 3, 4, 5, 6, 7],
        [0, 4, 5, 6, 7],
        [0, 100, 101, 102],  # a leap counts as 5 s
        [0, 5, 6, 7],
        [0, 1, 1, 1, 2, 3, 4, 5, 6, 7],
        [0, 1, -9, -8, -7, -6, -5, -4, -3],
    ],
)
def test_a_period_is_measured_in_seconds_that_have_passed(times: list[float]) -> None:
    said = follow([-2.0] * len(times), Effect(7.0), times)
    assert said[:-1] == [None] * (len(times) - 1) and "stood for 7 s" in str(said[-1])


@pytest.mark.parametrize(
    ("margins", "known"),
    [
        ([-2.0, -2.0, -2.0], True),
        ([-2.0, NAN, -2.0], False),
        ([-2.0, -2.0], False),
        ([-2.0, NAN, -2.0, NAN, -2.0, NAN], True),
        ([NAN, -2.0, NAN, -2.0, NAN, -2.0, NAN], False),
        ([-math.inf, -2.0, -math.inf, -2.0, -2.0, math.inf], True),
        ([NAN] * 6, False),
    ],
)
def test_a_limit_is_judged_on_three_readings_and_on_half_of_them(margins: list[float], known: bool) -> None:
    said = follow(margins, Effect(len(margins) - 1.0))[-1]
    assert said is not None and ("the limit cannot be judged" in said[1]) is not known
    assert known is ("-2 L on average" in said[1])


def test_readings_of_one_moment_only_do_not_rise() -> None:
    said = follow([-2.0, -1.9, -1.8, NAN], Effect(5.0), [0.0, 0.0, 0.0, 10.0])
    assert said[-1] is not None and "does not rise" in said[-1][1]


@pytest.mark.parametrize(("slope", "helps"), [(1e-4, True), (0.0, False), (-1e-4, False)])
@pytest.mark.parametrize("far", [-2.0, -1e5])
def test_a_margin_without_noise_rises_by_however_little(slope: float, far: float, helps: bool) -> None:
    step = slope * abs(far)
    assert (follow([far + step * n for n in range(21)], Effect(20.0))[-1] is None) is helps


def test_readings_within_a_second_rise_as_well() -> None:
    assert follow([-3.0, -2.0, -1.0], Effect(1.0), [0.0, 0.5, 1.0])[-1] is None


def test_a_margin_rises_by_three_standard_errors_of_its_least_squares_slope() -> None:
    rng = np.random.default_rng(3)
    verdicts = []
    for n in (3, 4, 6, 10, 31):
        t = np.arange(n, dtype=float)
        for _ in range(12):
            noise = rng.normal(0.0, 0.1, n)
            noise -= np.polyval(np.polyfit(t, noise, 1), t)
            error = math.sqrt(float(noise @ noise) / (n - 2) / float(((t - t.mean()) ** 2).sum()))
            for errors, rises in ((2.97, False), (3.03, True), (-3.03, False)):
                margins = -50.0 + errors * error * t + noise
                verdicts.append((follow([float(m) for m in margins], Effect(n - 1.0))[-1] is None) is rises)
    assert all(verdicts)


def test_of_several_limits_the_first_that_is_not_helped_is_named_and_each_has_its_own_time() -> None:
    strategy = replace(DRAIN, serves={"A": Effect(4.0), "B": Effect(2.0), "C": Effect(2.0)})
    watch, said = EffectWatch(()), []
    for now_s in range(5):
        violations = [Violation(name, -1.0, "L", name) for name in ("A", "B", "C")]
        found = watch.failed(float(now_s), strategy, violations)
        said.append(found[0] if found else "")
    assert said == ["", "", "B", "", "A"]


def test_a_limit_that_came_back_or_another_strategy_has_its_time_from_the_start() -> None:
    strategy, watch = replace(DRAIN, serves={"A": Effect(3.0)}), EffectWatch(())
    outside = [Violation("A", -1.0, "L", "")]
    said = [watch.failed(float(n), strategy, [] if n == 2 else outside) is not None for n in range(8)]
    assert said == [False] * 6 + [True, False]
    watch.clear()
    assert [watch.failed(10.0 + n, strategy, outside) is not None for n in range(4)] == [False] * 3 + [True]


@pytest.mark.parametrize(("acts_within_s", "every_s"), [(36.0, 5), (16.0, 2), (400.0, 5)])
def test_how_far_a_period_has_come_is_journalled_eight_times_or_every_5_s(acts_within_s: float, every_s: int) -> None:
    strategy = replace(DRAIN, serves={"LIM-FULL": Effect(acts_within_s)})
    watch = EffectWatch((strategy,))
    said = []
    for now_s in range(100, 116):
        watch.failed(now_s, strategy, [Violation("LIM-FULL", -1.0, "L", "it is full")])
        said += [int(e.passed_s) for e in watch.news(strategy)]
    assert said == list(range(0, 16, every_s))


def test_a_strategy_of_which_the_tables_say_nothing_has_as_long_as_the_slowest_that_serves_the_limit() -> None:
    slow, quick = (replace(DRAIN, serves={"LIM-FULL": Effect(within_s)}) for within_s in (9.0, 5.0))
    silent = replace(DRAIN, serves={})
    for others in ((slow, quick), (quick, slow)):
        watch = EffectWatch(others)
        said = [watch.failed(now_s, silent, [Violation("LIM-FULL", -1.0, "L", "it is full")]) for now_s in range(12)]
        assert [n for n, s in enumerate(said) if s] == [9]
