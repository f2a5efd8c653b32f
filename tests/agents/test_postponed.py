"""Postponed: a wait for the fallback is admitted only where no limit is worse for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.postponed import LONGER, judge_postponed, outside_s
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Revise, Rollout
from tests.safety.world import ACTIONS, DRAIN, HOT, LIMITS, MEMBERS, broken_down, rollout

REST = ActionSet((), "running")


def hot(actions: ActionSet, *at: tuple[int, int], kelvin: float = 314.0) -> Rollout:
    """A rollout with a temperature above the limit of 313 K at some samples of some members."""
    found = rollout(actions)
    for member, row in at:
        found.trajectory.signals["T"][member, row] = kelvin
    return found


def test_a_wait_after_which_everything_is_kept_is_approved_by_its_own_digest() -> None:
    verdict = judge_postponed(REST, rollout(REST), DRAIN.actions, rollout(DRAIN.actions), LIMITS)
    assert isinstance(verdict, Approve) and verdict.digest == REST.digest and verdict.min_margin >= 0.0


def test_what_falling_back_at_once_keeps_must_be_kept_later() -> None:
    verdict = judge_postponed(REST, hot(REST, (1, 3)), DRAIN.actions, rollout(DRAIN.actions), LIMITS)
    assert isinstance(verdict, Revise) and {f.criterion for f in verdict.violated} == {"LIM-HOT", "ACC-CALM"}


@pytest.mark.parametrize(("kelvin", "approved"), [(313.5, True), (314.0, True), (314.01, False)])
def test_what_is_left_either_way_may_be_left_by_no_more(kelvin: float, approved: bool) -> None:
    at_once, later = hot(DRAIN.actions, (0, 2)), hot(REST, (2, 5), kelvin=kelvin)
    assert isinstance(judge_postponed(REST, later, DRAIN.actions, at_once, LIMITS), Approve) is approved


@pytest.mark.parametrize(("samples", "approved"), [(3, True), (4, False)])
def test_nor_may_it_be_left_for_much_longer(samples: int, approved: bool) -> None:
    """A sample is 5 s: one at once, and three later are 10 s longer."""
    later = hot(REST, *((1, k) for k in range(samples)))
    verdict = judge_postponed(REST, later, DRAIN.actions, hot(DRAIN.actions, (0, 0)), LIMITS)
    assert isinstance(verdict, Approve) is approved
    if isinstance(verdict, Revise):
        (refused,) = verdict.violated
        assert refused.criterion == LONGER and "15 s longer" in refused.message and HOT.name in refused.message


def test_a_member_that_cannot_be_judged_counts_as_outside() -> None:
    later = hot(REST, (0, 0), kelvin=float("nan"))
    assert outside_s(HOT, later) == 5.0
    assert isinstance(judge_postponed(REST, later, DRAIN.actions, rollout(DRAIN.actions), LIMITS), Revise)


@pytest.mark.parametrize("which", ["later", "at once", "both"])
def test_where_the_twin_breaks_down_nothing_is_postponed(which: str) -> None:
    later = rollout(REST) if which == "at once" else broken_down(REST)
    at_once = rollout(DRAIN.actions) if which == "later" else broken_down(DRAIN.actions)
    assert isinstance(judge_postponed(REST, later, DRAIN.actions, at_once, LIMITS), Revise)


def test_a_rollout_of_something_else_says_nothing() -> None:
    assert isinstance(judge_postponed(REST, rollout(ACTIONS), DRAIN.actions, rollout(DRAIN.actions), LIMITS), Revise)


def test_members_are_not_mixed_up_by_how_many_there_are() -> None:
    one = hot(DRAIN.actions, (MEMBERS - 1, 0))
    fewer = replace(
        one, trajectory=replace(one.trajectory, signals={k: v[-1:] for k, v in one.trajectory.signals.items()})
    )
    assert outside_s(HOT, fewer) == outside_s(HOT, one) == 5.0
    assert np.isfinite(outside_s(HOT, rollout(REST)))
