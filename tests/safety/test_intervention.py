"""When a plant may be left alone: never where something that protects it is violated or was not judged."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.checks import judge
from homeostat.domain.plant.limits import LimitKind, Limits, Owner
from homeostat.domain.plant.production import Production
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Finding, Revise, Rollout, Verdict
from homeostat.recovery.intervention import GAIN, RISK, TOLERANCE, InterventionPolicy
from tests.safety.world import CALM, COLD, FEED, HOT, RUNNING, TAGS, broken_down, criterion, rollout, rule

SOFT = criterion("ACC-SOFT", "always (T <= 400)")
LIMITS = Limits((HOT, COLD, FEED), (CALM, SOFT))
SCALE = 2.0
IDLE = ActionSet((), "running")


def policy(limits: Limits = LIMITS) -> InterventionPolicy:
    return InterventionPolicy(limits, Production("F", 0.03), {"K": SCALE, "1": SCALE})


def finding(name: str, margin: float) -> Finding:
    return Finding(name, Owner.ACTION, margin, "K", 0.0, 0, name)


def revise(**margins: float) -> Revise:
    return Revise(tuple(finding(name.replace("_", "-"), margin) for name, margin in margins.items()))


KEPT = {"ACC_CALM": 1.0, "LIM_HOT": 1.0, "ACC_SOFT": 1.0, "LIM_COLD": 1.0, "PRM_FEED": 1.0}


def test_what_is_approved_is_fine() -> None:
    assert policy().fine(Approve("x", ()), recovered=False) and policy().fine(Approve("x", ()), recovered=True)


@pytest.mark.parametrize("margin", [-1e-300, -1e-9, -0.5, math.nextafter(-TOLERANCE * SCALE, 0.0)])
def test_a_recovered_plant_may_miss_a_soft_criterion_by_a_little(margin: float) -> None:
    missed = revise(**KEPT | {"ACC_SOFT": margin})
    assert policy().fine(missed, recovered=True)
    assert not policy().fine(missed, recovered=False)


@pytest.mark.parametrize(
    "margin", [-TOLERANCE * SCALE, math.nextafter(-TOLERANCE * SCALE, -1.0), -1.0, -1e308, -math.inf, math.nan]
)
def test_not_by_much(margin: float) -> None:
    assert not policy().fine(revise(**KEPT | {"ACC_SOFT": margin}), recovered=True)


def test_one_criterion_that_is_missed_by_much_is_enough() -> None:
    limits = Limits((HOT,), (SOFT, criterion("ACC-OTHER", "always (T >= 200)")))
    assert policy(limits).fine(revise(LIM_HOT=1.0, ACC_SOFT=-0.1, ACC_OTHER=-0.2), recovered=True)
    for margins in ((-0.1, -5.0), (-5.0, -0.1)):
        missed = revise(LIM_HOT=1.0, ACC_SOFT=margins[0], ACC_OTHER=margins[1])
        assert not policy(limits).fine(missed, recovered=True)


@pytest.mark.parametrize("name", ["ACC_CALM", "LIM_HOT", "LIM_COLD", "PRM_FEED", "TARGET_running", "CHK_RANGE"])
@pytest.mark.parametrize("margin", [-5e-324, -1e-9, -1.0, -math.inf, math.nan])
def test_nothing_else_may_be_missed_by_anything(name: str, margin: float) -> None:
    assert not policy().fine(revise(**KEPT | {name: margin}), recovered=True)
    assert not policy().fine(revise(**KEPT | {name: margin, "ACC_SOFT": -0.1}), recovered=True)


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


def test_a_judged_rollout_is_harmless_where_only_soft_rules_fail() -> None:
    tight = Limits((HOT,), (CALM, criterion("ACC-SOFT", "always (T <= 300)")))
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


def producing(rate: float) -> Rollout:
    made = rollout(IDLE)
    made.trajectory.signals["F"][:] = np.array([[rate - 0.01], [rate], [rate + 0.01]])
    return made


@pytest.mark.parametrize(
    ("rate", "worthwhile"), [(0.0, True), (0.0296, True), (0.0298, False), (0.03, False), (0.06, False)]
)
def test_a_plant_that_makes_what_it_can_is_not_touched(rate: float, worthwhile: bool) -> None:
    assert policy().worthwhile(producing(rate)) is worthwhile


@pytest.mark.parametrize(
    ("better", "gains"), [(0.02, False), (0.0202, False), (0.0204, True), (0.03, True), (0.01, False)]
)
def test_an_action_must_produce_clearly_more(better: float, gains: bool) -> None:
    assert policy().gains(producing(0.02), producing(better)) is gains


def constant(rate: float) -> Rollout:
    made = rollout(IDLE)
    return replace(made, trajectory=replace(made.trajectory, signals={"F": np.full((1, 1), rate)}))


def test_the_edge_itself_is_not_worth_it() -> None:
    edge = InterventionPolicy(LIMITS, Production("F", 1.0), {})
    assert not edge.worthwhile(constant(1.0 - GAIN)) and edge.worthwhile(constant(math.nextafter(1.0 - GAIN, 0.0)))
    assert not edge.gains(constant(0.5), constant(0.5 + GAIN))
    assert edge.gains(constant(0.5), constant(math.nextafter(0.5 + GAIN, 1.0)))


@pytest.mark.parametrize("risk_added", [-1, 0, 1, 2])
def test_a_riskier_action_must_produce_more_and_a_safer_one_may_produce_less(risk_added: int) -> None:
    edge = InterventionPolicy(LIMITS, Production("F", 1.0), {})
    enough = 0.5 + GAIN + RISK * risk_added
    assert not edge.gains(constant(0.5), constant(enough - 1e-9), risk_added)
    assert edge.gains(constant(0.5), constant(enough + 1e-9), risk_added)
    assert edge.gains(constant(0.5), constant(0.5 + GAIN + 1e-9)) is True, "no rank is added where none is named"


def test_what_protects_is_enough() -> None:
    assert policy().harmless(revise(ACC_CALM=1.0, LIM_HOT=1.0))


def test_clearly_means_a_hundredth_of_the_design_rate() -> None:
    assert GAIN == 0.01 and 0.0 < TOLERANCE < 1.0
    assert RISK >= GAIN, "a rank of risk weighs more than what is hardly worth a touch"
