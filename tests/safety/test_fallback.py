"""The choice of the fallback: the least harmful known strategy, always one."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy
from homeostat.domain.verdict import Approve, Revise
from homeostat.recovery.arming import ValidatedFallback, by_danger, rank
from tests.safety.world import COLD, DRAIN, LIMITS, VENT, broken_down, rollout, rule

SCALES = {"K": 1.0, "L": 1.0}
WET = rule("LIM-WET", LimitKind.TRIP_LIMIT, "L <= 11", hard=True)
BOTH = Limits((*LIMITS.limits, WET), LIMITS.criteria)


def serving(strategy: FallbackStrategy, *limits: str) -> FallbackStrategy:
    return replace(strategy, serves={name: Effect(60.0) for name in limits})


def strategy(name: str) -> FallbackStrategy:
    return FallbackStrategy(name, ActionSet((Command("L.sp", float(len(name)), None),), "still"))


def chosen(*hot: tuple[FallbackStrategy, float]) -> ValidatedFallback:
    return rank([(s, rollout(s.actions, T=value)) for s, value in hot], LIMITS, SCALES)[0]


def test_the_strategy_with_most_distance_is_chosen() -> None:
    assert chosen((DRAIN, 310.0), (VENT, 306.0)).strategy == VENT
    assert chosen((DRAIN, 306.0), (VENT, 310.0)).strategy == DRAIN


def test_of_equals_the_first_in_the_table_is_chosen() -> None:
    assert chosen((DRAIN, 308.0), (VENT, 308.0)).strategy == DRAIN
    assert chosen((VENT, 308.0), (DRAIN, 308.0)).strategy == VENT


def test_margins_that_do_not_differ_leave_the_order_of_the_table() -> None:
    assert chosen((DRAIN, 308.0), (VENT, 307.95)).strategy == DRAIN
    assert chosen((DRAIN, 308.0), (VENT, 307.85)).strategy == VENT
    assert chosen((strategy("third"), 307.95), (DRAIN, 308.0), (VENT, 307.9)).strategy == strategy("third")


def test_an_approved_strategy_beats_a_refused_one() -> None:
    best = chosen((DRAIN, 330.0), (VENT, 312.8))
    assert best.strategy == VENT and isinstance(best.verdict, Approve)


def test_without_an_approved_one_the_least_harmful_is_chosen_and_says_so() -> None:
    best = chosen((DRAIN, 330.0), (VENT, 320.0), (strategy("third"), 325.0))
    assert best.strategy == VENT and isinstance(best.verdict, Revise)
    assert min(f.margin for f in best.findings) == pytest.approx(-7.1)


def test_a_strategy_whose_rollout_breaks_down_is_the_last_choice() -> None:
    known = [(DRAIN, broken_down(DRAIN.actions)), (VENT, rollout(VENT.actions, T=350.0))]
    assert rank(known, LIMITS, SCALES)[0].strategy == VENT
    lost = rank(known[:1], LIMITS, SCALES)[0]
    assert lost.strategy == DRAIN and [f.margin for f in lost.findings] == [-math.inf]


def test_the_worst_margin_of_a_strategy_decides_not_its_best() -> None:
    even = (DRAIN, rollout(DRAIN.actions, T=308.0, L=7.0))
    lopsided = (VENT, rollout(VENT.actions, T=280.0, L=10.0))
    assert rank([lopsided, even], BOTH, SCALES)[0].strategy == DRAIN


def test_margins_of_different_units_are_compared_in_their_scales() -> None:
    cool = (DRAIN, rollout(DRAIN.actions, T=303.0, L=10.9))
    dry = (VENT, rollout(VENT.actions, T=310.0, L=7.0))
    assert rank([dry, cool], BOTH, {"K": 0.1, "L": 0.1})[0].strategy == VENT, "2.9 K, 0.1 L"
    assert rank([dry, cool], BOTH, {"K": 10.0, "L": 0.01})[0].strategy == DRAIN, "0.1 L are ten scales"


def test_of_those_that_are_approved_one_that_serves_what_is_in_danger_comes_first() -> None:
    far, near = serving(DRAIN, "LIM-WET"), serving(VENT, "LIM-T-HIGH")
    known = [(far, rollout(DRAIN.actions, T=300.0)), (near, rollout(VENT.actions, T=312.0))]
    assert rank(known, LIMITS, SCALES)[0].strategy == far, "nothing is in danger: the margin"
    assert rank(known, LIMITS, SCALES, ("LIM-T-HIGH",))[0].strategy == near
    assert rank(known, LIMITS, SCALES, ("LIM-WET", "LIM-T-HIGH"))[0].strategy == far, "what trips first counts first"
    assert rank(known, LIMITS, SCALES, ("LIM-OTHER",))[0].strategy == far, "neither serves it"


def test_one_that_serves_and_is_refused_comes_behind_what_is_approved() -> None:
    serves = serving(VENT, "LIM-T-HIGH")
    known = [(DRAIN, rollout(DRAIN.actions, T=310.0)), (serves, rollout(VENT.actions, T=320.0))]
    assert rank(known, LIMITS, SCALES, ("LIM-T-HIGH",))[0].strategy == DRAIN


@pytest.mark.parametrize(("hotter", "first"), [(0.0, "serves"), (0.09, "serves"), (0.5, "least harm")])
def test_of_those_that_are_refused_it_comes_first_only_where_it_does_no_more_harm(hotter: float, first: str) -> None:
    serves = serving(VENT, "LIM-T-HIGH")
    known = [(DRAIN, rollout(DRAIN.actions, T=320.0)), (serves, rollout(VENT.actions, T=320.0 + hotter))]
    found = rank(known, LIMITS, SCALES, ("LIM-T-HIGH",))[0].strategy
    assert found == (serves if first == "serves" else DRAIN)


def test_without_rollouts_those_that_serve_what_is_in_danger_come_first_else_the_tables_order() -> None:
    serves = serving(VENT, "LIM-T-HIGH")
    assert by_danger((DRAIN, serves), ("LIM-T-HIGH",)) == (serves, DRAIN)
    assert by_danger((DRAIN, serves), ()) == by_danger((DRAIN, serves), ("LIM-OTHER",)) == (DRAIN, serves)


def test_where_nothing_is_judged_any_rollout_beats_a_breakdown() -> None:
    known = [(DRAIN, broken_down(DRAIN.actions)), (VENT, rollout(VENT.actions))]
    assert rank(known, Limits((COLD,), ()), SCALES)[0].strategy == VENT


def test_soft_limits_do_not_decide() -> None:
    cold = [(DRAIN, rollout(DRAIN.actions, T=250.0)), (VENT, rollout(VENT.actions, T=312.0))]
    assert rank(cold, LIMITS, SCALES)[0].strategy == DRAIN
    assert rank(cold, Limits((COLD,), ()), SCALES)[0].strategy == DRAIN, "nothing is judged: table order"


def test_the_rollout_must_be_of_the_strategy() -> None:
    mixed_up = rank([(DRAIN, rollout(VENT.actions))], LIMITS, SCALES)[0]
    assert isinstance(mixed_up.verdict, Revise)


def test_there_must_be_a_strategy() -> None:
    with pytest.raises(ValueError):
        rank([], LIMITS, SCALES)
