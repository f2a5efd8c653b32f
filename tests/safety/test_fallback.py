"""The choice of the fallback: the least harmful known strategy, always one."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from homeostat.domain.verdict import Approve, Revise
from homeostat.recovery.arming import ValidatedFallback, rank
from tests.safety.world import COLD, DRAIN, LIMITS, VENT, broken_down, rollout, rule


def strategy(name: str) -> FallbackStrategy:
    return FallbackStrategy(name, ActionSet((Command("L.sp", float(len(name)), None),), "still"))


def chosen(*hot: tuple[FallbackStrategy, float]) -> ValidatedFallback:
    return rank([(s, rollout(s.actions, T=value)) for s, value in hot], LIMITS)[0]


def test_the_strategy_with_most_distance_is_chosen() -> None:
    assert chosen((DRAIN, 310.0), (VENT, 306.0)).strategy == VENT
    assert chosen((DRAIN, 306.0), (VENT, 310.0)).strategy == DRAIN


def test_of_equals_the_first_in_the_table_is_chosen() -> None:
    assert chosen((DRAIN, 308.0), (VENT, 308.0)).strategy == DRAIN
    assert chosen((VENT, 308.0), (DRAIN, 308.0)).strategy == VENT


def test_an_approved_strategy_beats_a_refused_one() -> None:
    best = chosen((DRAIN, 330.0), (VENT, 312.8))
    assert best.strategy == VENT and isinstance(best.verdict, Approve)


def test_without_an_approved_one_the_least_harmful_is_chosen_and_says_so() -> None:
    best = chosen((DRAIN, 330.0), (VENT, 320.0), (strategy("third"), 325.0))
    assert best.strategy == VENT and isinstance(best.verdict, Revise)
    assert min(f.margin for f in best.findings) == pytest.approx(-7.1)


def test_a_strategy_whose_rollout_breaks_down_is_the_last_choice() -> None:
    known = [(DRAIN, broken_down(DRAIN.actions)), (VENT, rollout(VENT.actions, T=350.0))]
    assert rank(known, LIMITS)[0].strategy == VENT
    lost = rank(known[:1], LIMITS)[0]
    assert lost.strategy == DRAIN and [f.margin for f in lost.findings] == [-math.inf]


def test_the_worst_margin_of_a_strategy_decides_not_its_best() -> None:
    wet = Limits((*LIMITS.limits, rule("LIM-WET", LimitKind.TRIP_LIMIT, "L <= 11", hard=True)), LIMITS.criteria)
    even = (DRAIN, rollout(DRAIN.actions, T=308.0, L=7.0))
    lopsided = (VENT, rollout(VENT.actions, T=280.0, L=10.0))
    assert rank([lopsided, even], wet)[0].strategy == DRAIN


def test_where_nothing_is_judged_any_rollout_beats_a_breakdown() -> None:
    known = [(DRAIN, broken_down(DRAIN.actions)), (VENT, rollout(VENT.actions))]
    assert rank(known, Limits((COLD,), ()))[0].strategy == VENT


def test_soft_limits_do_not_decide() -> None:
    cold = [(DRAIN, rollout(DRAIN.actions, T=250.0)), (VENT, rollout(VENT.actions, T=312.0))]
    assert rank(cold, LIMITS)[0].strategy == DRAIN
    assert rank(cold, Limits((COLD,), ()))[0].strategy == DRAIN, "nothing is judged: table order"


def test_the_rollout_must_be_of_the_strategy() -> None:
    mixed_up = rank([(DRAIN, rollout(VENT.actions))], LIMITS)[0]
    assert isinstance(mixed_up.verdict, Revise)


def test_there_must_be_a_strategy() -> None:
    with pytest.raises(ValueError):
        rank([], LIMITS)
