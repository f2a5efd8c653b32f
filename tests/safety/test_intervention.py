"""When a plant may be left alone: never where something that protects it is violated or was not judged."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.checks import judge
from homeostat.agents.pricing import Pricing
from homeostat.domain.plant.limits import LimitKind, Limits, Owner
from homeostat.domain.plant.prices import Price, PriceKind, prices_of
from homeostat.domain.plant.production import Production
from homeostat.domain.recovery import ActionSet, Step
from homeostat.domain.verdict import Approve, Finding, Revise, Rollout, Verdict
from homeostat.recovery.intervention import InterventionPolicy
from homeostat.recovery.look.news import Look
from tests.agents.scripted import diagnosis
from tests.recovery.desk import tick
from tests.safety.world import (
    CALM,
    COLD,
    FEED,
    HOT,
    MACHINE,
    POUR,
    RUNNING,
    TAGS,
    broken_down,
    criterion,
    rollout,
    rule,
)

SOFT = criterion("ACC-SOFT", "always (T <= 400)")
LIMITS = Limits((HOT, COLD, FEED), (CALM, SOFT))
SCALE = 2.0
IDLE = ActionSet((), "running")


SCALES = {"K": SCALE, "1": SCALE}


def policy(limits: Limits = LIMITS, *rows: Price) -> InterventionPolicy:
    prices = prices_of(rows, Production("F", 0.03), "EUR", limits, MACHINE)
    return InterventionPolicy(limits, Pricing(prices, limits, SCALES), SCALES)


def looked(
    verdict: Verdict, idle: Rollout | None = None, limits: Limits = LIMITS, then: tuple[Step, ...] = (), *rows: Price
) -> Look:
    """A look at a vessel that runs, and of which ``then`` is what is left of its sequence."""
    shown = rollout(IDLE) if idle is None else idle
    now = replace(tick(7.0), rest=ActionSet((), "running", then))
    return policy(limits, *rows).look(now, diagnosis(7.0), shown, verdict)


def finding(name: str, margin: float) -> Finding:
    return Finding(name, Owner.ACTION, margin, "K", 0.0, 0, name)


def revise(**margins: float) -> Revise:
    return Revise(tuple(finding(name.replace("_", "-"), margin) for name, margin in margins.items()))


KEPT = {"ACC_CALM": 1.0, "LIM_HOT": 1.0, "ACC_SOFT": 1.0, "LIM_COLD": 1.0, "PRM_FEED": 1.0}


def producing(rate: float) -> Rollout:
    """A rollout of 60 s that makes ``rate`` in the mean of its members [L/s]."""
    made = rollout(IDLE)
    spread = min(0.01, max(0.03 - rate, 0.0))  # what one member makes beyond the design does not make up for another
    made.trajectory.signals["F"][:] = np.array([[rate - spread], [rate], [rate + spread]])
    return made


def test_what_is_approved_is_fine_and_nothing_else() -> None:
    assert looked(Approve("x", ())).fine
    assert not looked(Revise(())).fine and not looked(revise(**KEPT | {"ACC_SOFT": -1e-300})).fine


@pytest.mark.parametrize("name", ["ACC_CALM", "LIM_HOT", "PRM_FEED", "TARGET_running", "CHK_RANGE"])
@pytest.mark.parametrize("margin", [-5e-324, -1e-9, -1.0, -math.inf, math.nan])
def test_nothing_that_forbids_may_be_missed_by_anything(name: str, margin: float) -> None:
    assert not looked(revise(**KEPT | {name: margin})).fine


@pytest.mark.parametrize("missed", [306.5, 312.0])
def test_what_only_costs_is_fine_however_much_it_is_missed(missed: float) -> None:
    soft = Limits((HOT, rule("LIM-WARM", LimitKind.ENVELOPE, "T >= 320")), (CALM, criterion("ACC-W", "T <= 300")))
    idle = rollout(IDLE, T=missed)
    found = looked(judge(IDLE, idle, soft, RUNNING, TAGS), idle, soft)
    assert found.fine and found.harmless and set(found.margins) == {"ACC-CALM", "LIM-HOT", "TARGET-running"}
    assert found.cost is not None and {i.name for i in found.cost.items} >= {"ACC-W", "LIM-WARM"}


def test_a_look_has_the_least_margin_of_each_criterion_in_scales() -> None:
    twice = Revise((finding("ACC-CALM", 4.0), finding("ACC-CALM", -1.0), finding("ACC-CALM", 2.0)))
    found = looked(twice)
    assert found.margins == {"ACC-CALM": -0.5} and (found.at_s, found.state) == (7.0, "running")
    assert found.diagnosis == diagnosis(7.0)


def test_leaving_the_plant_alone_releases_nothing_and_pays_for_the_states_that_follow() -> None:
    """Running has risk 1, emptying 2: 2 % of what is made by design in the 60 s that are looked at."""
    here = looked(Approve("x", ()), producing(0.02)).cost
    assert here is not None and {i.name: i.amount for i in here.items} == pytest.approx(
        {"production": 0.01 * 60.0, "running": 0.01 * 0.03 * 60.0}
    )
    assert here.worth == pytest.approx(0.03 * 60.0)
    after = looked(Approve("x", ()), producing(0.02), LIMITS, (POUR,)).cost
    assert after is not None and {i.name for i in after.items} == {"production", "emptying"}
    assert after.total > here.total


def test_where_the_twin_cannot_say_nobody_knows_what_it_costs() -> None:
    nothing = replace(broken_down(IDLE), weights=())
    assert looked(judge(IDLE, nothing, LIMITS, RUNNING, TAGS), nothing).cost is None


@pytest.mark.parametrize("name", ["ACC_CALM", "LIM_HOT"])
@pytest.mark.parametrize(
    ("margin", "harmless"),
    [(0.0, True), (-0.0, True), (5e-324, True), (-5e-324, False), (-1.0, False), (math.nan, False)],
)
def test_harm_is_what_a_protecting_rule_says(name: str, margin: float, harmless: bool) -> None:
    assert policy().harmless(revise(**KEPT | {name: margin})) is harmless
    assert policy().harmless(revise(**KEPT | {name: margin, "ACC_SOFT": -5.0, "LIM_COLD": -5.0})) is harmless


@pytest.mark.parametrize(
    "verdict",
    [
        Revise(()),
        revise(CHK_ROLLOUT=-math.inf),
        judge(IDLE, broken_down(IDLE), LIMITS, RUNNING, TAGS),
        judge(IDLE, rollout(IDLE, T=math.nan), LIMITS, RUNNING, TAGS),
        judge(IDLE, rollout(), LIMITS, RUNNING, TAGS),
        revise(LIM_COLD=1.0, ACC_SOFT=-1.0),
        revise(LIM_HOT=1.0, ACC_SOFT=-1.0),
        revise(ACC_CALM=1.0, ACC_SOFT=-1.0),
    ],
    ids=["nothing", "refused", "broken down", "not finite", "another set", "only soft", "no criterion", "no limit"],
)
def test_what_was_not_judged_is_not_harmless(verdict: Verdict) -> None:
    assert policy().harmless(verdict) is False


def test_a_judged_rollout_is_harmless_where_nothing_fails_that_protects() -> None:
    tight = Limits((HOT, rule("LIM-MILD", LimitKind.TRIP_LIMIT, "T <= 300")), (CALM,))
    verdict = judge(IDLE, rollout(IDLE), tight, RUNNING, TAGS)
    assert isinstance(verdict, Revise) and policy(tight).harmless(verdict)
    hot = judge(IDLE, rollout(IDLE, T=313.5), tight, RUNNING, TAGS)
    assert not policy(tight).harmless(hot)


def test_where_no_rule_protects_nothing_is_known_to_be_harmless() -> None:
    assert not policy(Limits((COLD,), (SOFT,))).harmless(revise(LIM_COLD=1.0, ACC_SOFT=1.0))


def test_a_soft_trip_limit_does_not_protect() -> None:
    mild = rule("LIM-MILD", LimitKind.TRIP_LIMIT, "T <= 300")
    limits = Limits((HOT, mild), (CALM,))
    assert policy(limits).harmless(judge(IDLE, rollout(IDLE), limits, RUNNING, TAGS))


def test_what_protects_is_enough() -> None:
    assert policy().harmless(revise(ACC_CALM=1.0, LIM_HOT=1.0))


RELEASE = Price(PriceKind.RELEASE, "release", 0.06)
FREE = Price(PriceKind.STATE, "running", 0.0)


@pytest.mark.parametrize(
    ("rate", "worthwhile"),
    [(0.0, True), (0.0289, True), (math.nextafter(0.029, 0.0), None), (0.0291, False), (0.03, False), (0.06, False)],
)
def test_a_plant_is_touched_where_leaving_it_costs_more_than_a_release(rate: float, worthwhile: bool | None) -> None:
    """A release costs 0.06 EUR, which is what 0.001 L/s less make in 60 s."""
    found = looked(Approve("x", ()), producing(rate), LIMITS, (), RELEASE, FREE)
    assert found.cost is not None
    expected = found.cost.total > 0.06 if worthwhile is None else worthwhile
    assert policy(LIMITS, RELEASE, FREE).worthwhile(found) is expected


def test_the_edge_itself_is_not_worth_it() -> None:
    found = looked(Approve("x", ()), producing(0.02))
    assert found.cost is not None
    for release, worthwhile in ((found.cost.total, False), (math.nextafter(found.cost.total, 0.0), True)):
        assert policy(LIMITS, Price(PriceKind.RELEASE, "release", release)).worthwhile(found) is worthwhile


def test_what_nobody_can_price_is_worth_a_thought() -> None:
    unknown = replace(looked(Approve("x", ())), cost=None)
    assert policy().worthwhile(unknown)
    endless = looked(Approve("x", ()), rollout(IDLE, F=math.inf))
    assert endless.cost is not None and endless.cost.total == math.inf and policy().worthwhile(endless)
