"""Every check under the same attack; see `tests.safety.boundary`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.checks import judge, judge_safety
from homeostat.agents.pricing import Pricing
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.prices import prices_of
from homeostat.domain.plant.production import Production
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.verdict import Approve, Rollout
from homeostat.guard.requests.permissives import permissive_findings
from tests.safety.boundary import BoundaryAttack
from tests.safety.world import (
    ACTIONS,
    CALM,
    COLD,
    FEED,
    HOT,
    LIMITS,
    MACHINE,
    MEMBERS,
    NO_LIMITS,
    RUNNING,
    SAMPLES,
    TAGS,
    criterion,
    reading,
    rollout,
    rule,
)

ONLY_HOT, ONLY_COLD, ONLY_FEED = Limits((HOT,), ()), Limits((COLD,), ()), Limits((FEED,), ())
ONLY_CALM = Limits((), (CALM,))


def approves(actions: ActionSet, tried: Rollout, limits: Limits) -> bool:
    verdict = judge(actions, tried, limits, RUNNING, TAGS)
    if isinstance(verdict, Approve):
        assert verdict.digest == actions.digest and verdict.min_margin >= 0.0
        return True
    assert verdict.violated
    return False


class OnRollout(BoundaryAttack):
    """One member of the rollout has the value at one sample: the first, the last, or one between."""

    tag: str
    limits: Limits
    at = ((0, 0), (1, SAMPLES // 2), (MEMBERS - 1, SAMPLES - 1))

    def allows(self, value: float) -> bool:
        judged = {approves(ACTIONS, rollout(at=at, **{self.tag: value}), self.limits) for at in self.at}
        assert len(judged) == 1, f"{value!r} is judged differently in different places"
        return judged.pop()


class TestTripLimit(OnRollout):
    tag, limits, limit, at_most = "T", ONLY_HOT, 313.0, True


class TestEnvelope(OnRollout):
    """A hard one."""

    tag, limits, limit, at_most = "T", Limits((replace(COLD, hard=True),), ()), 298.0, False


class TestCriterion(OnRollout):
    tag, limits, limit, at_most = "T", ONLY_CALM, 312.9, True


class TestLimitAtZero(OnRollout):
    """Where the limit is zero there are denormal numbers on both sides of it."""

    tag, limit, at_most = "L", 0.0, False
    limits = Limits((rule("LIM-DRY", LimitKind.TRIP_LIMIT, "L >= 0"),), ())


class TestAllLimitsTogether(OnRollout):
    """The strictest of several rules on one tag decides."""

    tag, limits, limit, at_most = (
        "T",
        Limits((HOT, rule("LIM-HOTTER", LimitKind.TRIP_LIMIT, "T <= 320")), (CALM,)),
        312.9,
        True,
    )


class TestPermissiveOnRollout(OnRollout):
    """A permissive is judged at the moment of release."""

    tag, limits, limit, at_most = "L", ONLY_FEED, 11.0, True
    at = ((0, 0), (1, 0), (MEMBERS - 1, 0))


class TestTarget(OnRollout):
    """The target state is judged at the end."""

    tag, limits, limit, at_most = "F_sp", NO_LIMITS, 0.01, False
    at = ((0, SAMPLES - 1), (1, SAMPLES - 1), (MEMBERS - 1, SAMPLES - 1))


class TestFallbackOnRollout(OnRollout):
    """A fallback is judged by what protects the plant: here the hard criterion is the strictest."""

    tag, limits, limit, at_most = "T", LIMITS, 312.9, True

    def allows(self, value: float) -> bool:
        verdicts = [judge_safety(ACTIONS, rollout(at=at, T=value), self.limits) for at in self.at]
        return all(isinstance(v, Approve) for v in verdicts)


class TestFallbackHardLimit(TestFallbackOnRollout):
    limits, limit, at_most = ONLY_HOT, 313.0, True


class OnCommand(BoundaryAttack):
    """The value is commanded."""

    tag = "T.sp"
    slack = 1e-9 * 312.0

    def allows(self, value: float) -> bool:
        try:
            actions = ActionSet((Command(self.tag, value, 0.001),), "running")
        except ValueError as refused:
            assert "must be finite" in str(refused)
            return False
        return approves(actions, rollout(actions), NO_LIMITS)


class TestHighSetpoint(OnCommand):
    limit, at_most, lowest = 312.0, True, 298.0


class TestLowSetpoint(OnCommand):
    limit, at_most = 298.0, False

    def expected(self, value: float) -> bool:
        return super().expected(value) and value <= 312.0


class TestLowSetpointAtZero(OnCommand):
    tag, limit, at_most, slack = "F.sp", 0.0, False, 1e-9

    def expected(self, value: float) -> bool:
        return super().expected(value) and value <= 0.05 + 1e-9


class TestHighManualOutput(OnCommand):
    tag, limit, at_most, slack, lowest = "V.man", 1.0, True, 1e-9, 0.0


class TestRate(BoundaryAttack):
    """The rate of a command; one that is not positive cannot be commanded."""

    limit, at_most, lowest = 0.5, True, 5e-324

    def allows(self, value: float) -> bool:
        try:
            actions = ActionSet((Command("T.sp", 305.0, value),), "running")
        except ValueError as refused:
            assert "must be finite and > 0" in str(refused)
            return False
        return approves(actions, rollout(actions), NO_LIMITS)

    @pytest.mark.parametrize("value", [0.0, -0.0, -5e-324, -1.0])
    def test_a_rate_that_is_not_positive_is_no_command(self, value: float) -> None:
        assert self.allows(value) is False

    def test_a_step_is_faster_than_any_limit(self) -> None:
        step = ActionSet((Command("T.sp", 305.0, None),), "running")
        assert not approves(step, rollout(step), NO_LIMITS)

    def test_a_tag_without_rate_limit_may_step(self) -> None:
        step = ActionSet((Command("L.sp", 9.0, None),), "running")
        assert approves(step, rollout(step), NO_LIMITS)


class TestPermissiveOnSnapshot(BoundaryAttack):
    limit, at_most = 11.0, True

    def allows(self, value: float) -> bool:
        (found,) = permissive_findings(reading(L=value), ACTIONS.commands, LIMITS)
        return found.satisfied


class TestPermissiveOnCommand(BoundaryAttack):
    """The permissive reads a tag that the release itself sets: the commanded value counts, not the present one."""

    limit, at_most = 0.04, True
    limits = Limits((rule("PRM-LOAD", LimitKind.PERMISSIVE, "F.sp <= 0.04"),), ())

    def allows(self, value: float) -> bool:
        try:
            actions = ActionSet((Command("F.sp", value, None),), "running")
        except ValueError:
            return False
        on_snapshot = [f.satisfied for f in permissive_findings(reading(F_sp=0.05), actions.commands, self.limits)]
        on_snapshot += [f.satisfied for f in permissive_findings(reading(F_sp=0.01), actions.commands, self.limits)]
        assert len(set(on_snapshot)) == 1
        return on_snapshot[0]


class TestPermissiveOnRolloutOfCommand(TestPermissiveOnCommand):
    def allows(self, value: float) -> bool:
        try:
            actions = ActionSet((Command("F.sp", value, 0.001),), "running")
        except ValueError:
            return False
        verdict = judge(actions, rollout(actions, F_sp=0.05), self.limits, RUNNING, TAGS)
        return all(f.satisfied for f in verdict.findings if f.criterion == "PRM-LOAD")


class OnPrice(BoundaryAttack):
    """What does not forbid costs nothing where it holds, and something where it does not, or cannot be judged."""

    tag: str
    limits: Limits
    at = ((0, 0), (1, SAMPLES // 2), (MEMBERS - 1, SAMPLES - 1))

    def allows(self, value: float) -> bool:
        prices = prices_of((), Production("F", 0.03), "EUR", self.limits, MACHINE)
        priced = Pricing(prices, self.limits, {"K": 1.0, "L/s": 1.0})
        free = set()
        for at in self.at:
            tried = rollout(at=at, **{self.tag: value})
            (each,) = priced.outside(tried.trajectory.signals, tried.trajectory.dt_s).values()
            assert approves(ACTIONS, tried, self.limits) and (np.delete(each, at[0]) == 0.0).all()
            assert not each[at[0]] < 0.0 and not np.isnan(each[at[0]])
            free.add(bool(each[at[0]] == 0.0))
        assert len(free) == 1, f"{value!r} is priced differently in different places"
        return free.pop()


class TestPriceOfAnEnvelope(OnPrice):
    tag, limits, limit, at_most = "T", ONLY_COLD, 298.0, False


class TestPriceOfACriterion(OnPrice):
    tag, limits, limit, at_most = "T", Limits((), (criterion("ACC-SOFT", "T <= 306"),)), 306.0, True


class TestPriceOfACriterionThatLooksAhead(OnPrice):
    tag, limits, limit, at_most = "T", Limits((), (criterion("ACC-SOFT", "always (T <= 306)"),)), 306.0, True


def test_soft_rules_do_not_count_for_a_fallback() -> None:
    soft = Limits((COLD, FEED), (criterion("ACC-SOFT", "always (T >= 300)"),))
    assert isinstance(judge_safety(ACTIONS, rollout(T=290.0, L=12.0), soft), Approve)
    assert not isinstance(
        judge_safety(ACTIONS, rollout(T=290.0), Limits((), (criterion("H", "always (T >= 300)", True),))), Approve
    )


def test_a_permissive_does_not_bind_after_the_release() -> None:
    late = rollout(at=(1, 1), L=12.0)
    assert approves(ACTIONS, late, ONLY_FEED)
