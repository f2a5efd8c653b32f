"""Readings and rollouts that say nothing: they never count as within limits."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.agents.checks import judge, judge_safety
from homeostat.agents.pricing import Pricing
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.prices import prices_of
from homeostat.domain.plant.production import Production
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve, Revise
from homeostat.guard.requests.permissives import permissive_findings, unjudged, usable
from tests.safety.world import (
    ACTIONS,
    COLD,
    FEED,
    GOOD,
    HOT,
    LIMITS,
    MACHINE,
    NO_LIMITS,
    RUNNING,
    TAGS,
    criterion,
    reading,
    rollout,
    rule,
)

APPROVAL = Approve(ACTIONS.digest, ())
WILD = [math.nan, math.inf, -math.inf]


def without(tag: str) -> Snapshot:
    return Snapshot(100.0, {t: v for t, v in GOOD.items() if t != tag})


def blind_snapshots(tag: str) -> list[Snapshot]:
    return [*(reading(**{tag: value}) for value in WILD), reading(bad=frozenset({tag})), without(tag)]


@pytest.mark.parametrize("snapshot", blind_snapshots("L"))
def test_a_permissive_without_reading_does_not_hold(snapshot: Snapshot) -> None:
    (found,) = permissive_findings(snapshot, ACTIONS.commands, LIMITS)
    assert not found.satisfied and found.criterion == "PRM-FEED" and found.margin == -math.inf
    assert "'L'" in found.message and "PRM-FEED" in found.message


def test_a_commanded_tag_needs_no_reading() -> None:
    limits = Limits((rule("PRM-LOAD", LimitKind.PERMISSIVE, "F.sp <= 0.04"),), ())
    for snapshot in blind_snapshots("F_sp"):
        (found,) = permissive_findings(snapshot, ACTIONS.commands, limits)
        assert found.satisfied and found.margin == pytest.approx(0.02)


def test_a_tag_that_is_handed_back_to_automatic_has_no_value_after_the_release() -> None:
    limits = Limits((rule("PRM-VALVE", LimitKind.PERMISSIVE, "V.man >= 0.5"),), ())
    hand_back = (Command("V.man", None, None),)
    (found,) = permissive_findings(reading(V_man=0.9), hand_back, limits)
    assert not found.satisfied
    (found,) = permissive_findings(reading(V_man=0.9), (), limits)
    assert found.satisfied


def test_usable_readings_are_finite_and_not_marked() -> None:
    snapshot = reading(T=math.nan, L=math.inf, F=-math.inf, bad=frozenset({"T.sp"}))
    assert usable(snapshot) == {"F.sp": 0.03, "L.sp": 10.0}


def test_every_missing_tag_is_named() -> None:
    both = rule("LIM-BOTH", LimitKind.TRIP_LIMIT, "T <= 313 and L <= 2")
    assert unjudged(both, {"T": 1.0, "L": 1.0}) is None
    assert "of 'L' (" in str(unjudged(both, {"T": 1.0})) and "of 'L', 'T' (" in str(unjudged(both, {}))


def test_what_the_other_readings_decide_can_be_judged() -> None:
    either = rule("LIM-EITHER", LimitKind.TRIP_LIMIT, "T <= 313 or L <= 2")
    assert unjudged(either, {"T": 1.0}) is None
    assert "of 'L' (" in str(unjudged(either, {"T": 314.0}))


def test_a_permissive_without_a_value_does_not_hold() -> None:
    limits = Limits((rule("PRM-RATIO", LimitKind.PERMISSIVE, "L / V.man <= 20"),), ())
    (found,) = permissive_findings(reading(V_man=0.0), (), limits)
    assert not found.satisfied and "has no value at these readings" in found.message


@pytest.mark.parametrize("value", WILD)
@pytest.mark.parametrize("at", [(0, 0), (2, 11)])
def test_a_rollout_that_is_not_finite_is_refused(value: float, at: tuple[int, int]) -> None:
    """An infinite temperature is 'below 313 K' by an infinite margin if its sign is right; it must not count."""
    verdict = judge(ACTIONS, rollout(at=at, T=value), LIMITS, RUNNING, TAGS)
    assert isinstance(verdict, Revise) and "'T' is not finite" in verdict.violated[0].message
    assert isinstance(judge_safety(ACTIONS, rollout(at=at, T=value), LIMITS), Revise)


def test_a_rollout_may_be_undefined_where_nothing_is_judged() -> None:
    assert math.isnan(GOOD["V.man"])
    assert isinstance(judge(ACTIONS, rollout(F=math.nan), LIMITS, RUNNING, TAGS), Approve)
    assert isinstance(judge_safety(ACTIONS, rollout(L=math.inf), Limits((HOT, FEED), ())), Approve)


def priced(limits: Limits, **changed: float) -> float:
    """What a rollout costs with one sample ``changed`` [EUR]."""
    prices = prices_of((), Production("F", 0.03), "EUR", limits, MACHINE)
    return Pricing(prices, limits, {}).of(rollout(**changed), ("running",)).total


@pytest.mark.parametrize("value", WILD)
def test_what_is_not_finite_is_worth_nothing_and_costs_more_than_anything(value: float) -> None:
    """An infinite throughput would be worth more than everything that a plant can make."""
    assert priced(NO_LIMITS, F=value) == math.inf
    for limits in (Limits((COLD,), ()), Limits((), (criterion("C", "T <= 400"), criterion("D", "T >= 0")))):
        assert priced(limits, T=value) == math.inf
    assert math.isfinite(priced(NO_LIMITS, T=value, L=value)), "nobody pays for those"


def test_a_wish_that_the_other_readings_decide_is_priced() -> None:
    """A valve on automatic has no opening."""
    either = Limits((), (criterion("C", "V.man >= 0.5 or T <= 306"),))
    assert math.isnan(GOOD["V.man"]) and math.isfinite(priced(either)) and priced(either, T=306.5) == math.inf


def test_the_target_is_among_what_is_judged() -> None:
    tried = rollout(F_sp=math.inf)
    assert isinstance(judge(ACTIONS, tried, NO_LIMITS, RUNNING, TAGS), Revise)


def test_each_kind_of_rule_is_among_what_is_judged() -> None:
    hard = Limits((), (criterion("C", "always (T <= 400)", hard=True),))
    for limits in (Limits((HOT,), ()), Limits((replace(COLD, hard=True),), ()), Limits((FEED,), ()), hard):
        tried = rollout(T=-math.inf, L=-math.inf)
        assert isinstance(judge(ACTIONS, tried, limits, RUNNING, TAGS), Revise)
    assert isinstance(judge_safety(ACTIONS, rollout(T=-math.inf), Limits((HOT,), ())), Revise)
    assert isinstance(judge_safety(ACTIONS, rollout(T=-math.inf), hard), Revise)
