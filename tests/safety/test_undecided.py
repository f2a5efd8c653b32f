"""What a formula leaves undecided is never counted as kept, wherever margins are weighed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.checks import judge, judge_safety, rollout_findings, target_finding, worst
from homeostat.agents.pricing import Pricing
from homeostat.agents.search.cost import Cost
from homeostat.domain.plant.limits import Criterion, LimitKind, Limits, Owner
from homeostat.domain.plant.prices import prices_of
from homeostat.domain.plant.production import Production
from homeostat.domain.snapshot import Trajectory
from homeostat.domain.verdict import Approve, Revise
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import exposures, inside_at_end
from homeostat.recovery.deadline import first_violated_s
from homeostat.stl.formula import parse
from tests.safety.world import ACTIONS, HOT, MACHINE, MEMBERS, RUNNING, SAMPLES, TAGS, criterion, rollout, rule

RATIO = rule("LIM-RATIO", LimitKind.TRIP_LIMIT, "T / L <= 100", hard=True)
"""Undecided where the level is zero."""
QUOTIENT = criterion("ACC-RATIO", "always (T / L <= 100)", hard=True)
EMPTY = rollout(at=(1, 3), L=0.0)
"""The second member's vessel is empty for one sample."""


@pytest.mark.parametrize("limits", [Limits((RATIO,), ()), Limits((), (QUOTIENT,))])
def test_a_rollout_that_leaves_a_rule_undecided_is_refused(limits: Limits) -> None:
    assert isinstance(judge(ACTIONS, rollout(), limits, RUNNING, TAGS), Approve)
    for verdict in (judge(ACTIONS, EMPTY, limits, RUNNING, TAGS), judge_safety(ACTIONS, EMPTY, limits)):
        assert isinstance(verdict, Revise)
        (finding,) = verdict.violated
        assert finding.margin == -math.inf and finding.member == 1 and "cannot be judged" in finding.message


def test_the_undecided_member_is_the_worst_one_in_any_order() -> None:
    for order in ([1.0, 0.0, 2.0], [0.0, 1.0, 2.0], [2.0, 1.0, 0.0]):
        signals = {"x": np.array(order)[:, np.newaxis]}
        found = worst(Criterion("A", Owner.ACTION, parse("1 / x <= 0.7"), True, "", "Ratio"), signals, 1.0)
        assert not found.satisfied and found.margin == -math.inf and found.member == order.index(0.0)


def test_a_target_that_cannot_be_judged_is_not_reached() -> None:
    ends = replace(RUNNING, settled_when=parse("T / L <= 100"))
    assert target_finding(rollout(), ends).satisfied
    assert not target_finding(rollout(at=(2, SAMPLES - 1), L=0.0), ends).satisfied


def test_a_permissive_that_one_step_leaves_undecided_is_violated() -> None:
    limits = (rule("PRM-RATIO", LimitKind.PERMISSIVE, "T / L <= 100"),)
    (found,) = rollout_findings(rollout(at=(0, 0), L=0.0), (), limits, ACTIONS)
    assert not found.satisfied and math.isinf(found.margin)


def test_thinking_ends_before_a_limit_that_can_no_longer_be_judged() -> None:
    assert first_violated_s(EMPTY, Limits((RATIO,), ())) == 3 * EMPTY.trajectory.dt_s
    assert first_violated_s(rollout(), Limits((RATIO,), ())) == math.inf


def test_a_second_that_cannot_be_judged_is_a_second_outside() -> None:
    truth = Trajectory(1.0, 1.0, {"T": np.full((1, 10), 310.0), "L": np.array([[8.0] * 4 + [0.0] * 3 + [8.0] * 3])})
    force = LimitsInForce(Limits((RATIO,), ()))
    (found,) = exposures(truth, force, 0.0)
    assert found.total_s == 3.0 and not inside_at_end(truth, force)


def test_a_candidate_that_cannot_be_judged_costs_more_than_any_other() -> None:
    limits = Limits((HOT, RATIO), (QUOTIENT,))
    prices = prices_of((), Production("F", 1.0), "EUR", limits, MACHINE)
    cost = Cost(limits, Pricing(prices, limits, {}), {}, 0.0)
    members, candidates = np.ones(MEMBERS), (ACTIONS,) * 3
    signals = {tag: np.full((3 * MEMBERS, 4), value) for tag, value in (("T", 310.0), ("L", 8.0), ("F", 1.0))}
    signals["T"][MEMBERS, 0] = 400.0
    signals["L"][2 * MEMBERS, 0] = 0.0
    good, hot, undecided = cost.of(signals, 1.0, members, candidates)
    assert good < hot < undecided
    for value in (math.nan, math.inf, -math.inf):
        signals["F"][0, 0] = value
        assert cost.of(signals, 1.0, members, candidates)[0] == math.inf


def test_a_wish_that_cannot_be_judged_costs_more_than_any_that_is_missed() -> None:
    limits = Limits((), (criterion("ACC-RATIO", "T / L <= 100"),))
    prices = prices_of((), Production("F", 1.0), "EUR", limits, MACHINE)
    cost = Cost(limits, Pricing(prices, limits, {}), {}, 0.0)
    signals = {tag: np.full((2 * MEMBERS, 4), value) for tag, value in (("T", 1e6), ("L", 8.0), ("F", 1.0))}
    signals["L"][MEMBERS, 0] = 0.0
    missed, undecided = cost.of(signals, 1.0, np.ones(MEMBERS), (ACTIONS,) * 2)
    assert missed < undecided == math.inf
