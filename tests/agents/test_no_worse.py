"""No worse: what violates a limit only where the fallback does, and no worse, may be released; nothing else may."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.agents.checks import judge_safety
from homeostat.agents.no_worse import comparable, judge_no_worse, worse
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Finding, Revise, Rollout, Verdict
from tests.agents.test_postponed import hot
from tests.safety.world import ACTIONS, DRAIN, LIMITS, MEMBERS, broken_down, rollout

SCALES = {"K": 1.0}


def judged(mine: Rollout, its: Rollout) -> Verdict:
    """What is said of ``mine`` beside ``its``."""
    return judge_no_worse(judge_safety(ACTIONS, mine, LIMITS), mine, its, LIMITS, SCALES)


def approved(mine: Rollout, its: Rollout) -> bool:
    return isinstance(judged(mine, its), Approve)


def test_what_is_violated_at_once_either_way_is_approved_and_says_by_how_much() -> None:
    verdict = judged(hot(ACTIONS, (1, 0)), hot(DRAIN.actions, (1, 0)))
    assert isinstance(verdict, Approve) and verdict.digest == ACTIONS.digest
    assert verdict.min_margin == pytest.approx(-1.1)  # 0.1 K below the limit is asked for


def test_what_the_fallback_keeps_must_be_kept_however_little_is_missing() -> None:
    assert not approved(hot(ACTIONS, (1, 0), kelvin=313.001), rollout(DRAIN.actions))


@pytest.mark.parametrize(("its", "mine", "expected"), [
    (312.99, 313.10, True), (312.99, 313.18, True), (312.99, 313.20, False), (312.5, 313.001, False),
])  # fmt: skip
def test_a_member_that_the_fallback_just_keeps_counts_as_one_that_it_does_not(
    its: float, mine: float, expected: bool
) -> None:
    """Where it violates the limit in another member: where it keeps it in all, so must the release."""
    fallback = hot(DRAIN.actions, (2, 0))
    fallback.trajectory.signals["T"][1, 0] = its
    release = hot(ACTIONS, (2, 0))
    release.trajectory.signals["T"][1, 0] = mine
    assert worse(release, fallback, LIMITS, SCALES)[1] is not expected
    kept, alone = hot(DRAIN.actions, (1, 0), kelvin=its), hot(ACTIONS, (1, 0), kelvin=mine)
    assert worse(alone, kept, LIMITS, SCALES)[1]


def test_without_slack_whatever_is_left_deeper_is_worse() -> None:
    mine, its = hot(ACTIONS, (1, 0), kelvin=314.01), hot(DRAIN.actions, (1, 0))
    assert worse(mine, its, LIMITS, SCALES, slack=0.0)[1] and not worse(its, mine, LIMITS, SCALES, slack=0.0).any()


def test_it_is_compared_member_by_member() -> None:
    """Another member is violated by the fallback: that spares the one that it keeps."""
    assert not approved(hot(ACTIONS, (1, 0)), hot(DRAIN.actions, (2, 0)))
    assert approved(hot(ACTIONS, (1, 0)), hot(DRAIN.actions, (1, 0), (2, 0)))


@pytest.mark.parametrize(("kelvin", "expected"), [(313.5, True), (314.19, True), (314.21, False)])
def test_what_is_left_either_way_may_be_left_by_a_fifth_of_a_scale_more(kelvin: float, expected: bool) -> None:
    assert approved(hot(ACTIONS, (1, 0), kelvin=kelvin), hot(DRAIN.actions, (1, 0))) is expected


@pytest.mark.parametrize(("samples", "expected"), [(3, True), (4, False)])
def test_nor_may_it_be_left_for_much_longer(samples: int, expected: bool) -> None:
    """A sample is 5 s: three are 10 s longer than one."""
    mine = hot(ACTIONS, *((1, k) for k in range(samples)))
    assert approved(mine, hot(DRAIN.actions, (1, 0))) is expected


@pytest.mark.parametrize(("its", "samples", "expected"), [(4, 8, True), (4, 9, False), (3, 7, False)])
def test_as_long_again_is_not_much_longer(its: int, samples: int, expected: bool) -> None:
    """The fallback needs 20 s, or 15 s."""
    mine, fallback = (hot(a, *((1, k) for k in range(n))) for a, n in ((ACTIONS, samples), (DRAIN.actions, its)))
    assert approved(mine, fallback) is expected


def test_a_hard_criterion_counts_as_a_limit_does() -> None:
    assert not approved(hot(ACTIONS, (1, 3), kelvin=312.95), rollout(DRAIN.actions))
    assert approved(hot(ACTIONS, (1, 3), kelvin=312.95), hot(DRAIN.actions, (1, 0), kelvin=312.95))


def test_what_cannot_be_judged_is_worse_than_anything_that_can() -> None:
    undecided = hot(ACTIONS, (0, 0), kelvin=math.nan)
    assert worse(undecided, hot(DRAIN.actions, (0, 0)), LIMITS, SCALES).tolist()[0]
    assert not worse(undecided, hot(DRAIN.actions, (0, 0), kelvin=math.nan), LIMITS, SCALES).any()


def test_where_the_twin_breaks_down_nothing_is_as_safe() -> None:
    mine, its = hot(ACTIONS, (1, 0)), hot(DRAIN.actions, (1, 0))
    assert worse(mine, broken_down(DRAIN.actions), LIMITS, SCALES).tolist() == [True] * MEMBERS
    assert worse(mine, replace(its, weights=its.weights[:-1]), LIMITS, SCALES).all()
    assert not worse(mine, its, LIMITS, SCALES).any()


@pytest.mark.parametrize(("names", "expected"), [
    (("LIM-HOT",), True), (("LIM-HOT", "ACC-CALM"), True), (("PRM-FEED",), False), (("LIM-HOT", "PRM-FEED"), False),
    (("CHK-RANGE",), False), (("TARGET-running",), False),
])  # fmt: skip
def test_only_what_protects_the_plant_is_compared(names: tuple[str, ...], expected: bool) -> None:
    verdict = Revise(tuple(Finding(n, Owner.ACTION, -1.0, "K", 0.0, 0, n) for n in names))
    assert comparable(verdict, LIMITS) is expected
    mine = hot(ACTIONS, (1, 0))
    found = judge_no_worse(verdict, mine, hot(DRAIN.actions, (1, 0)), LIMITS, SCALES)
    assert isinstance(found, Approve) is expected


def test_an_approval_stays_what_it_is() -> None:
    mine = rollout(ActionSet((), "running"))
    approval = Approve(mine.digest, ())
    assert judge_no_worse(approval, mine, rollout(DRAIN.actions), LIMITS, SCALES) is approval
    assert not comparable(approval, LIMITS)
