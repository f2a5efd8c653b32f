"""What a judgement refuses before and beside the limits, and what its findings say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.checks import (
    CLOSED,
    closed_finding,
    command_findings,
    judge,
    judge_safety,
    rollout_findings,
    target_finding,
    worst,
)
from homeostat.domain.plant.limits import LimitKind, Limits, Owner
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Trajectory
from homeostat.domain.verdict import Approve, Finding, Revise, RolloutResult, Verdict
from homeostat.guard.requests.permissives import permissive_findings
from homeostat.stl.formula import FormulaError
from tests.safety.world import (
    ACTIONS,
    CALM,
    HOT,
    LIMITS,
    MEMBERS,
    NO_LIMITS,
    RUNNING,
    SAMPLES,
    STILL,
    TAGS,
    broken_down,
    criterion,
    reading,
    rollout,
    rule,
)


def verdict(actions: ActionSet = ACTIONS, limits: Limits = NO_LIMITS, **changed: float) -> Verdict:
    return judge(actions, rollout(actions, **changed), limits, RUNNING, TAGS)


def only(found: Verdict) -> Finding:
    assert isinstance(found, Revise)
    (finding,) = found.violated
    return finding


def test_what_keeps_every_rule_is_approved_with_all_its_margins() -> None:
    found = verdict(limits=LIMITS)
    assert isinstance(found, Approve) and found.digest == ACTIONS.digest
    assert {f.criterion for f in found.findings} == {"ACC-CALM", "LIM-HOT", "PRM-FEED", "TARGET-running"}
    assert all(f.satisfied for f in found.findings) and found.min_margin == pytest.approx(0.02)


def test_what_only_costs_is_not_judged_and_refuses_nothing() -> None:
    wishes = Limits((HOT, rule("LIM-WARM", LimitKind.ENVELOPE, "T <= 200")), (criterion("ACC-W", "always (T <= 200)"),))
    found = verdict(limits=wishes)
    assert isinstance(found, Approve) and {f.criterion for f in found.findings} == {"LIM-HOT", "TARGET-running"}


@pytest.mark.parametrize(
    "forbids",
    [
        Limits((rule("X", LimitKind.ENVELOPE, "T <= 200", hard=True),), ()),
        Limits((rule("X", LimitKind.TRIP_LIMIT, "T <= 200"),), ()),
        Limits((rule("X", LimitKind.TRIP_LIMIT, "T <= 200", hard=True),), ()),
        Limits((rule("X", LimitKind.PERMISSIVE, "T <= 200"),), ()),
        Limits((), (criterion("X", "always (T <= 200)", hard=True),)),
    ],
    ids=["hard envelope", "soft trip limit", "hard trip limit", "permissive", "hard criterion"],
)
def test_everything_else_forbids_and_has_no_price_by_the_scale(forbids: Limits) -> None:
    assert only(verdict(limits=forbids)).criterion == "X" and forbids.priced == ()


def test_an_action_set_for_another_state_is_refused() -> None:
    elsewhere = replace(ACTIONS, target="still")
    for actions, target in ((elsewhere, RUNNING), (ACTIONS, STILL)):
        finding = only(judge(actions, rollout(actions), NO_LIMITS, target, TAGS))
        assert finding.criterion == "CHK-TARGET" and finding.margin == -math.inf
        assert repr(actions.target) in finding.message and repr(target.name) in finding.message


@pytest.mark.parametrize("safety", [False, True])
def test_the_rollout_of_another_action_set_is_refused(safety: bool) -> None:
    other = rollout(ActionSet(ACTIONS.commands[:1], "running"))
    found = judge_safety(ACTIONS, other, LIMITS) if safety else judge(ACTIONS, other, LIMITS, RUNNING, TAGS)
    assert only(found).criterion == "CHK-DIGEST"


@pytest.mark.parametrize("safety", [False, True])
def test_a_twin_that_broke_down_approves_nothing(safety: bool) -> None:
    broken = broken_down()
    found = judge_safety(ACTIONS, broken, LIMITS) if safety else judge(ACTIONS, broken, LIMITS, RUNNING, TAGS)
    finding = only(found)
    assert finding.criterion == "CHK-ROLLOUT" and "member 2 at t = 7 s" in finding.message
    assert RolloutResult.BROKE_DOWN.value in finding.message


def test_a_breakdown_counts_even_where_the_trajectory_looks_fine() -> None:
    lucky = replace(rollout(), result=RolloutResult.BROKE_DOWN)
    assert isinstance(judge(ACTIONS, lucky, LIMITS, RUNNING, TAGS), Revise)
    assert isinstance(judge_safety(ACTIONS, lucky, LIMITS), Revise)


def test_one_violation_among_many_refuses() -> None:
    rules = tuple(rule(f"LIM-{k}", LimitKind.TRIP_LIMIT, f"T <= {306 + k}") for k in range(5))
    for k in range(5):
        tight = (*rules[:k], rule("LIM-TIGHT", LimitKind.TRIP_LIMIT, "T <= 304"), *rules[k:])
        assert only(verdict(limits=Limits(tight, ()))).criterion == "LIM-TIGHT"


# --- commands ---------------------------------------------------------------------------------------------------


def complaints(*commands: Command) -> list[str]:
    return [f.criterion for f in command_findings(ActionSet(commands, "running"), RUNNING, TAGS)]


def test_only_what_the_state_lists_may_be_commanded() -> None:
    assert complaints(Command("T", 305.0, 0.1)) == ["CHK-ADMISSIBLE"]
    assert complaints(Command("F", 0.01, 0.001)) == ["CHK-ADMISSIBLE"]
    assert complaints(Command("", 0.0, 0.001)) == ["CHK-ADMISSIBLE"]
    (finding,) = command_findings(ActionSet((Command("T.sp", 300.0, 0.1),), "still"), STILL, TAGS)
    assert finding.criterion == "CHK-ADMISSIBLE" and finding.message == "'T.sp' may not be commanded in state 'still'"


def test_a_tag_that_is_not_known_is_refused_even_where_the_state_lists_it() -> None:
    known = {name: tag for name, tag in TAGS.items() if name != "T.sp"}
    (finding,) = command_findings(ActionSet((Command("T.sp", 305.0, 0.1),), "running"), RUNNING, known)
    assert finding.criterion == "CHK-ADMISSIBLE"


def test_a_good_command_does_not_excuse_a_bad_one() -> None:
    assert complaints(Command("T.sp", 305.0, 0.1), Command("F.sp", 0.06, 0.001)) == ["CHK-RANGE"]
    assert complaints(Command("T", 0.0, None), Command("T.sp", 400.0, 1.0), Command("F.sp", 0.02, 0.001)) == [
        "CHK-ADMISSIBLE", "CHK-RANGE", "CHK-RATE",
    ]  # fmt: skip


def test_no_command_at_all_has_nothing_wrong() -> None:
    assert complaints() == []


def test_only_manual_outputs_go_back_to_automatic() -> None:
    assert complaints(Command("V.man", None, None)) == []
    assert complaints(Command("T.sp", None, None)) == ["CHK-AUTOMATIC"]
    assert complaints(Command("T.sp", None, None), Command("F.sp", 1.0, 0.001)) == ["CHK-AUTOMATIC", "CHK-RANGE"]


def test_a_complaint_says_what_is_admitted() -> None:
    found = command_findings(ActionSet((Command("T.sp", 315.0, 1.0),), "running"), RUNNING, TAGS)
    out_of_range, too_fast = found
    assert out_of_range.message == "'T.sp' = 315 K in state 'running'; admitted are 298 to 312 K"
    assert (out_of_range.margin, out_of_range.unit, out_of_range.owner) == (-3.0, "K", Owner.ACTION)
    assert too_fast.message == "'T.sp' ramps at 1 K/s; limit 0.5 K/s"
    assert (too_fast.margin, too_fast.unit) == (-0.5, "K/s")
    (low,) = command_findings(ActionSet((Command("T.sp", 290.0, 0.1),), "running"), RUNNING, TAGS)
    assert low.margin == -8.0


def test_what_is_wrong_before_the_release_is_wrong_at_once_and_in_every_member() -> None:
    bad = (Command("T.sp", 315.0, 1.0), Command("T", 0.0, None), Command("F.sp", None, None))
    found = command_findings(ActionSet(bad, "running"), RUNNING, TAGS)
    found += permissive_findings(reading(L=12.0), ACTIONS.commands, LIMITS)
    found += permissive_findings(reading(), ACTIONS.commands, LIMITS)
    assert len(found) == 6
    assert {(f.at_s, f.member) for f in found} == {(0.0, 0)}


# --- rollouts ---------------------------------------------------------------------------------------------------


def test_the_worst_member_and_its_time_are_named() -> None:
    tried = rollout(at=(1, 4), dt_s=5.0, T=315.0)
    tried.trajectory.signals["T"][2, 7] = 314.0
    calm, hot, cold, _ = rollout_findings(tried, LIMITS.criteria, LIMITS.limits, ACTIONS)
    assert (hot.criterion, hot.margin, hot.member, hot.at_s, hot.unit) == ("LIM-HOT", -2.0, 1, 20.0, "K")
    assert (calm.member, calm.at_s) == (1, 20.0) and calm.margin == pytest.approx(-2.1)
    assert hot.message == "What LIM-HOT protects: 'T <= 313' is violated by 2 K at 20 s in 2 of 3 members (LIM-HOT)"
    assert cold.message.startswith("What LIM-COLD protects: 'T >= 298' holds by 7 K at ")
    assert hot.owner is Owner.ACTION


def test_a_criterion_keeps_its_owner() -> None:
    planning = criterion("ACC-P", "always (T <= 300)", hard=True, owner=Owner.PLANNING)
    assert only(verdict(limits=Limits((), (planning,)))).owner is Owner.PLANNING


def test_a_limit_that_is_met_exactly_holds() -> None:
    (finding,) = rollout_findings(rollout(T=313.0), (), (HOT,), ACTIONS)
    assert finding.margin == 0.0 and finding.satisfied and "holds by 0 K" in finding.message


def test_the_target_is_judged_in_every_member_at_the_end() -> None:
    tried = rollout(at=(2, SAMPLES - 1), dt_s=5.0, F_sp=0.004)
    finding = target_finding(tried, RUNNING)
    assert (finding.criterion, finding.owner, finding.member) == ("TARGET-running", Owner.PLANNING, 2)
    assert finding.margin == pytest.approx(-0.006) and finding.at_s == 5.0 * (SAMPLES - 1)
    assert "State 'running' is reached" in finding.message
    early = rollout(at=(2, SAMPLES - 2), F_sp=0.0)
    assert target_finding(early, RUNNING).satisfied


def test_a_formula_is_judged_by_its_worst_member() -> None:
    tried = rollout(at=(1, 3), dt_s=2.0, T=330.0)
    finding = worst(CALM, tried.trajectory.signals, 2.0)
    assert finding.margin == pytest.approx(-17.1) and (finding.member, finding.at_s) == (1, 6.0)


def test_a_criterion_that_looks_beyond_the_rollout_is_refused() -> None:
    """``always`` over an empty window holds; a rollout that is too short must not profit from it."""
    covered = SAMPLES * 5.0
    fits = criterion("ACC-FITS", f"always[{covered - 10:g},{covered:g}] (T <= 300)", hard=True)
    beyond = criterion("ACC-BEYOND", f"always[{covered + 5:g},{covered + 10:g}] (T <= 300)", hard=True)
    partly = criterion("ACC-PARTLY", f"eventually[0,{covered:g}] always[0,5] (T <= 306)", hard=True)
    assert "violated by 5 K" in only(verdict(limits=Limits((), (fits,)))).message
    for late in (beyond, partly):
        finding = only(verdict(limits=Limits((), (late,))))
        assert finding.margin == -math.inf and finding.criterion == late.name and "covers 60 s" in finding.message
    assert isinstance(judge_safety(ACTIONS, rollout(), Limits((), (beyond,))), Revise)


def test_a_criterion_to_the_end_is_judged_as_far_as_the_rollout_goes() -> None:
    to_the_end = Limits((), (criterion("ACC-END", "always (T <= 306)", hard=True),))
    assert isinstance(verdict(limits=to_the_end), Approve)
    assert only(verdict(limits=to_the_end, T=306.5)).criterion == "ACC-END"


def test_a_tag_that_the_twin_does_not_know_is_loud() -> None:
    tried = rollout()
    signals = {tag: values for tag, values in tried.trajectory.signals.items() if tag != "T"}
    with pytest.raises(FormulaError, match="'T'"):
        judge(ACTIONS, replace(tried, trajectory=Trajectory(0.0, 5.0, signals)), LIMITS, RUNNING, TAGS)


def test_one_member_suffices_to_refuse_whatever_its_weight() -> None:
    tried = replace(rollout(at=(MEMBERS - 1, 0), T=314.0), weights=(1.0, 0.0, 0.0))
    assert isinstance(judge(ACTIONS, tried, LIMITS, RUNNING, TAGS), Revise)


def test_a_permissive_sees_the_commanded_value_at_once() -> None:
    """The ramp starts from the old value; what counts is where the command leads."""
    limits = Limits((rule("PRM-LOAD", LimitKind.PERMISSIVE, "F.sp <= 0.025"),), ())
    ramp = rollout(ACTIONS)
    ramp.trajectory.signals["F.sp"][:] = np.linspace(0.03, 0.02, SAMPLES)
    assert isinstance(judge(ACTIONS, ramp, limits, RUNNING, TAGS), Approve)
    untouched = ActionSet((Command("T.sp", 305.0, 0.1),), "running")
    assert isinstance(judge(untouched, rollout(untouched), limits, RUNNING, TAGS), Revise)


def test_a_permissive_sees_what_a_manual_output_overrides_at_once() -> None:
    limits = Limits((rule("PRM-LOAD", LimitKind.PERMISSIVE, "F.sp <= 0.025"),), ()).with_manual({"V.man": "F.sp"})
    for by_hand, expected in ((0.02, Approve), (0.9, Revise)):
        actions = ActionSet((Command("V.man", by_hand, 0.01),), "running")
        tried = rollout(actions)
        tried.trajectory.signals["F.sp"][:] = 0.03 if expected is Approve else 0.015
        assert isinstance(judge(actions, tried, limits, RUNNING, TAGS), expected)


def test_a_tag_that_goes_back_to_automatic_is_judged_by_what_the_twin_says() -> None:
    limits = Limits((rule("PRM-VALVE", LimitKind.PERMISSIVE, "V.man >= 0.5"),), ())
    hand_back = ActionSet((Command("V.man", None, None),), "running")
    for opening, approved in ((0.9, True), (0.1, False)):
        tried = rollout(hand_back)
        tried.trajectory.signals["V.man"][:] = opening
        assert isinstance(judge(hand_back, tried, limits, RUNNING, TAGS), Approve) is approved


def test_trip_limits_see_the_ramp_and_not_the_commanded_value() -> None:
    limits = Limits((rule("LIM-LOAD", LimitKind.TRIP_LIMIT, "F.sp <= 0.025"),), ())
    ramp = rollout(ACTIONS)
    ramp.trajectory.signals["F.sp"][:] = np.linspace(0.03, 0.02, SAMPLES)
    assert only(judge(ACTIONS, ramp, limits, RUNNING, TAGS)).margin == pytest.approx(-0.005)


def test_a_path_that_closed_is_planning_s_to_replace() -> None:
    found = closed_finding(("running", "reduced"))
    assert (found.criterion, found.owner, found.margin, found.unit) == (CLOSED, Owner.PLANNING, -math.inf, "1")
    assert (found.at_s, found.member, found.satisfied) == (0.0, 0, False)
    assert "running > reduced" in found.message
