"""Attacks on action sets with later steps: what is judged is every step, on the path that the machine has."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.checks import ROUTE as ASTRAY_NAME
from homeostat.agents.checks import judge, judge_safety, rollout_findings
from homeostat.domain.plant.limits import LimitKind, Limits, Owner
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step
from homeostat.domain.verdict import Approve, Finding, Revise, Verdict
from homeostat.stl.formula import parse
from tests.safety.world import (
    ACTIONS,
    ADJUST,
    BATCH,
    EMPTY,
    EMPTYING,
    END,
    LIMITS,
    MACHINE,
    MEMBERS,
    NO_LIMITS,
    POUR,
    REST,
    ROUTE,
    RUNNING,
    SAMPLES,
    STILL,
    TAGS,
    awaited,
    rollout,
    rule,
)


def verdict(
    actions: ActionSet = BATCH, path: RecoveryPath | None = ROUTE, limits: Limits = NO_LIMITS, target: State = STILL,
    **changed: float,
) -> Verdict:  # fmt: skip
    """The verdict on a rollout that ends still, as the route does."""
    tried = rollout(actions, **changed)
    tried.trajectory.signals["F.sp"][:, -1] = 0.0
    return judge(actions, tried, limits, target, TAGS, path)


def only(found: Verdict) -> Finding:
    assert isinstance(found, Revise)
    (finding,) = found.violated
    return finding


def test_a_route_that_keeps_every_rule_is_approved_for_the_state_in_which_it_ends() -> None:
    found = verdict(limits=LIMITS)
    assert isinstance(found, Approve) and found.digest == BATCH.digest
    assert {f.criterion for f in found.findings} == {"ACC-CALM", "LIM-HOT", "PRM-FEED", "TARGET-still"}


@pytest.mark.parametrize("target", [RUNNING, EMPTYING])
def test_a_route_is_judged_for_its_end_and_not_for_where_it_passes(target: State) -> None:
    finding = only(verdict(target=target))
    assert finding.criterion == "CHK-TARGET" and "leads to 'still'" in finding.message


def test_a_route_that_does_not_arrive_in_some_member_is_refused() -> None:
    tried = rollout(BATCH)
    tried.trajectory.signals["F.sp"][:, -1] = 0.0
    tried.trajectory.signals["F.sp"][1, -1] = 0.01
    finding = only(judge(BATCH, tried, NO_LIMITS, STILL, TAGS, ROUTE))
    assert (finding.criterion, finding.member) == ("TARGET-still", 1)


@pytest.mark.parametrize(("left", "member"), [((0, 1), 1), ((2, 1), 0), ((1, 1), 0)])
def test_a_route_whose_steps_are_not_all_taken_is_refused_wherever_the_plant_stands(
    left: tuple[int, ...], member: int
) -> None:
    """The tank may be empty: where the transmitter that is waited for never says so, the batch does not go on."""
    tried = replace(rollout(BATCH), steps_left=left)
    tried.trajectory.signals["F.sp"][:, -1] = 0.0
    finding = only(judge(BATCH, tried, NO_LIMITS, STILL, TAGS, ROUTE))
    assert (finding.criterion, finding.owner, finding.unit) == ("TARGET-still", Owner.PLANNING, "steps")
    assert (finding.margin, finding.at_s, finding.member) == (-float(max(left)), 0.0, member)
    assert finding.message == f"State 'still' is not entered: {max(left)} of the steps are still waited for at the end"


def test_a_route_whose_steps_are_all_taken_is_approved() -> None:
    tried = replace(rollout(BATCH), steps_left=(0, 0))
    tried.trajectory.signals["F.sp"][:, -1] = 0.0
    assert isinstance(judge(BATCH, tried, NO_LIMITS, STILL, TAGS, ROUTE), Approve)


# --- astray -----------------------------------------------------------------------------------------------------


def test_later_steps_need_a_path() -> None:
    finding = only(verdict(path=None))
    assert finding.criterion == ASTRAY_NAME == "CHK-ROUTE" and finding.margin == -math.inf
    assert finding.message == "the action set has later steps, but no path through the state machine"


def test_without_later_steps_no_path_is_needed() -> None:
    assert isinstance(judge(ACTIONS, rollout(), NO_LIMITS, RUNNING, TAGS), Approve)
    adjust = RecoveryPath(MACHINE, (ADJUST,))
    assert isinstance(judge(ACTIONS, rollout(), NO_LIMITS, RUNNING, TAGS, adjust), Approve)


ASTRAY = {
    "guard left out": replace(BATCH, then=(replace(POUR, transition=replace(EMPTY, guard=parse("true"))), END)),
    "guard softened": replace(
        BATCH, then=(replace(POUR, transition=replace(EMPTY, guard=parse("L >= 8.999 and T <= 310", TAGS))), END)
    ),
    "last guard softened": replace(
        BATCH, then=(POUR, replace(END, transition=replace(REST, guard=parse("L <= 2", TAGS))))
    ),
    "another name": replace(BATCH, then=(replace(POUR, transition=replace(EMPTY, name="pour")), END)),
    "step left out": replace(BATCH, then=(END,)),
    "steps in another order": replace(BATCH, then=(END, replace(POUR, transition=replace(EMPTY, target="still")))),
    "a step twice": replace(BATCH, then=(POUR, POUR, END)),
    "decided instead of awaited": replace(
        BATCH, then=(replace(POUR, transition=replace(EMPTY, on_decision=True)), END)
    ),
    "another state": replace(BATCH, target="waiting"),
}


@pytest.mark.parametrize("change", ASTRAY)
def test_steps_that_are_not_those_of_the_path_are_refused(change: str) -> None:
    finding = only(verdict(ASTRAY[change]))
    assert finding.criterion == "CHK-ROUTE" and finding.margin == -math.inf
    assert "the path leads running > emptying > still, each behind its guard" in finding.message
    assert f"the steps lead {' > '.join(ASTRAY[change].states)};" in finding.message


def test_the_steps_of_another_path_are_refused() -> None:
    shorter = RecoveryPath(MACHINE, (ADJUST, EMPTY))
    assert only(verdict(path=shorter)).criterion == "CHK-ROUTE"
    further_on = RecoveryPath(MACHINE, (EMPTY, REST))
    assert isinstance(verdict(path=further_on), Approve), "on the way, from the same state, it is the same route"
    elsewhere = RecoveryPath(MACHINE, (REST,))
    assert only(verdict(path=elsewhere)).criterion == "CHK-ROUTE"


def test_a_route_that_only_waits_is_judged_from_where_the_plant_is() -> None:
    waiting = ActionSet((), "emptying", (END,))
    assert isinstance(verdict(waiting, RecoveryPath(MACHINE, (REST,))), Approve)
    assert only(verdict(waiting, RecoveryPath(MACHINE, (EMPTY, REST)))).criterion == "CHK-ROUTE"


def test_a_route_with_a_broken_rollout_is_refused_for_that() -> None:
    other = rollout(ACTIONS)
    assert only(judge(BATCH, other, NO_LIMITS, STILL, TAGS, ROUTE)).criterion == "CHK-DIGEST"
    assert only(judge(BATCH, other, NO_LIMITS, STILL, TAGS)).criterion == "CHK-DIGEST"
    assert isinstance(judge_safety(BATCH, other, NO_LIMITS), Revise)


# --- commands of later steps ------------------------------------------------------------------------------------


def pouring(*commands: Command) -> ActionSet:
    return replace(BATCH, then=(replace(POUR, commands=commands), END))


@pytest.mark.parametrize(
    ("command", "criterion", "message"),
    [
        (Command("F.sp", 0.02, 0.005), "CHK-RANGE", "'F.sp' = 0.02 L/s in state 'emptying'; admitted are 0 to 0.01"),
        (Command("F.sp", 0.0, 0.01), "CHK-RATE", "'F.sp' ramps at 0.01"),
        (Command("F.sp", 0.0, None), "CHK-RATE", "'F.sp'"),
        (Command("T.sp", 305.0, 0.5), "CHK-ADMISSIBLE", "'T.sp' may not be commanded in state 'emptying'"),
        (Command("F.sp", None, None), "CHK-AUTOMATIC", "'F.sp'"),
    ],
)
def test_a_later_step_is_held_to_what_its_own_state_admits(command: Command, criterion: str, message: str) -> None:
    finding = only(verdict(pouring(command)))
    assert finding.criterion == criterion and finding.message.startswith(message)
    assert finding.owner is Owner.ACTION


def test_what_a_later_state_admits_is_not_admitted_now() -> None:
    """The end admits nothing, and the first state admits what it admits: no step lends its ranges to another."""
    now = replace(BATCH, commands=(Command("L.sp", 9.0, None), Command("T.sp", 305.0, 0.5)))
    assert isinstance(verdict(now), Approve)
    assert only(verdict(replace(BATCH, commands=(Command("F.sp", 0.06, 0.005),)))).criterion == "CHK-RANGE"
    at_the_end = replace(BATCH, then=(POUR, replace(END, commands=(Command("F.sp", 0.0, 0.005),))))
    finding = only(verdict(at_the_end))
    assert finding.message == "'F.sp' may not be commanded in state 'still'"


def test_every_wrong_command_of_every_step_is_named() -> None:
    wrong = replace(
        BATCH,
        commands=(Command("F.sp", 0.06, 0.005),),
        then=(
            replace(POUR, commands=(Command("F.sp", 0.02, 0.005),)),
            replace(END, commands=(Command("T", 1.0, 1.0),)),
        ),
    )
    found = verdict(wrong)
    assert isinstance(found, Revise)
    assert [f.criterion for f in found.violated] == ["CHK-RANGE", "CHK-RANGE", "CHK-ADMISSIBLE"]


def test_without_later_steps_the_target_says_what_is_admitted_whatever_the_path_is() -> None:
    bad = replace(ACTIONS, commands=(Command("F.sp", 0.06, 0.005),))
    for path in (None, RecoveryPath(MACHINE, (ADJUST,))):
        assert only(judge(bad, rollout(bad), NO_LIMITS, RUNNING, TAGS, path)).criterion == "CHK-RANGE"
    good = replace(ACTIONS, commands=(Command("F.sp", 0.05, 0.005),))
    adjust = RecoveryPath(MACHINE, (ADJUST,))
    assert isinstance(judge(good, rollout(good), NO_LIMITS, RUNNING, TAGS, adjust), Approve)
    narrower = replace(RUNNING, setpoints=(SetpointRange("F.sp", 0.0, 0.04, 0.03),))
    assert only(judge(good, rollout(good), NO_LIMITS, narrower, TAGS, adjust)).criterion == "CHK-RANGE"


# --- permissives of later steps ---------------------------------------------------------------------------------


def permissive(text: str, actions: ActionSet = BATCH, **changed: float) -> Finding:
    """The finding on one permissive."""
    (finding,) = rollout_findings(
        rollout(actions, **changed), (), (rule("PRM-X", LimitKind.PERMISSIVE, text),), actions
    )
    return finding


def test_a_permissive_that_only_a_later_step_violates_refuses() -> None:
    """The first release commands 0.02 L/s, the second step 0: a permissive on the feed must see both."""
    finding = permissive("F.sp >= 0.01")
    assert not finding.satisfied and finding.margin == pytest.approx(-0.01)
    assert permissive("F.sp >= 0.01", replace(BATCH, then=())).satisfied
    limits = Limits((rule("PRM-X", LimitKind.PERMISSIVE, "F.sp >= 0.01"),), ())
    assert only(verdict(limits=limits)).criterion == "PRM-X"


def test_a_permissive_that_only_the_first_step_violates_refuses() -> None:
    assert permissive("F.sp <= 0.01").margin == pytest.approx(-0.01)
    assert permissive("F.sp <= 0.01", replace(BATCH, commands=())).margin == pytest.approx(-0.02), "as it is now: 0.03"


def test_the_worst_step_gives_the_margin_wherever_it_stands() -> None:
    def steps(*values: float) -> ActionSet:
        then = tuple(
            Step(awaited(f"t{k}", "a", "b", "true"), (Command("F.sp", v, None),)) for k, v in enumerate(values)
        )
        return ActionSet((), "running", then)

    for values in ((0.01, 0.04, 0.02), (0.04, 0.01, 0.02), (0.01, 0.02, 0.04)):
        assert permissive("F.sp <= 0.035", steps(*values)).margin == pytest.approx(-0.005)


def test_what_was_commanded_stays_until_it_is_commanded_again() -> None:
    """T.sp is commanded to 305 at once and by no later step: the later steps are judged with 305, not with 310."""
    assert permissive("T.sp <= 306 or F.sp >= 0.02").satisfied
    untouched = replace(BATCH, commands=(Command("F.sp", 0.02, 0.005),))
    assert not permissive("T.sp <= 306 or F.sp >= 0.02", untouched).satisfied
    lowering = pouring(Command("F.sp", 0.0, 0.005), Command("L.sp", 2.0, None))
    assert permissive("L.sp <= 3 or F.sp >= 0.02", lowering).satisfied, "a step's commands are judged together"


def test_the_member_and_the_time_of_a_permissive_are_those_of_the_release() -> None:
    finding = permissive("L <= 11", at=(2, 0), dt_s=5.0, L=12.0)
    assert (finding.member, finding.at_s, finding.margin) == (2, 0.0, -1.0)
    assert permissive("L <= 11", at=(2, 1), L=12.0).satisfied, "what is read later binds the sequencer, not the rollout"


VALUES = st.none() | st.floats(0.0, 0.05)


@given(VALUES, st.lists(VALUES, max_size=3), st.floats(0.0, 0.05))
def test_a_permissive_sees_the_worst_of_all_steps(first: float | None, later: list[float | None], limit: float) -> None:
    def commands(value: float | None) -> tuple[Command, ...]:
        return () if value is None else (Command("F.sp", value, None),)

    then = tuple(Step(awaited(f"t{k}", "a", "b", "true"), commands(v)) for k, v in enumerate(later))
    actions = ActionSet(commands(first), "running", then)
    present, seen = 0.03, []
    for value in (first, *later):
        present = present if value is None else value
        seen.append(limit - present)
    tried = rollout(actions)
    (finding,) = rollout_findings(tried, (), (rule("P", LimitKind.PERMISSIVE, f"F.sp <= {limit!r}"),), actions)
    assert finding.margin == pytest.approx(min(seen), abs=1e-15)


def test_trip_limits_are_judged_over_the_whole_rollout_whatever_the_steps_are() -> None:
    for at in ((0, 0), (1, SAMPLES // 2), (MEMBERS - 1, SAMPLES - 1)):
        tried = rollout(BATCH, at=at, T=313.5)
        tried.trajectory.signals["F.sp"][:, -1] = 0.0
        finding = only(judge(BATCH, tried, replace(LIMITS, criteria=()), STILL, TAGS, ROUTE))
        assert (finding.criterion, finding.member) == ("LIM-HOT", at[0])


def test_a_rollout_of_a_route_that_is_not_finite_is_refused() -> None:
    tried = rollout(BATCH)
    tried.trajectory.signals["F.sp"][:, -1] = np.nan
    assert isinstance(judge(BATCH, tried, NO_LIMITS, STILL, TAGS, ROUTE), Revise)
