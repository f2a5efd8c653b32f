"""What every validation agent must do. A test class inherits this and says which agent it is about."""

from __future__ import annotations

from dataclasses import replace

from homeostat.agents.roles import Validation
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Revise, Rollout, RolloutResult


class ValidationContract:
    """Inherit, and provide the fixtures ``validation``, ``actions``, ``target``, ``good`` and ``bad`` (rollouts)."""

    def test_what_keeps_every_rule_is_approved_by_its_digest(
        self, validation: Validation, actions: ActionSet, target: State, good: Rollout
    ) -> None:
        verdict = validation.judge(actions, good, target)
        assert isinstance(verdict, Approve) and verdict.digest == actions.digest
        assert all(f.satisfied for f in verdict.findings)

    def test_what_breaks_a_rule_is_refused_with_the_margin(
        self, validation: Validation, actions: ActionSet, target: State, bad: Rollout
    ) -> None:
        verdict = validation.judge(actions, bad, target)
        assert isinstance(verdict, Revise) and verdict.violated
        assert all(f.margin < 0.0 and f.message and "\n" not in f.message for f in verdict.violated)

    def test_a_rollout_of_something_else_approves_nothing(
        self, validation: Validation, actions: ActionSet, target: State, good: Rollout
    ) -> None:
        assert isinstance(validation.judge(actions, replace(good, digest="0" * 64), target), Revise)

    def test_a_breakdown_approves_nothing(
        self, validation: Validation, actions: ActionSet, target: State, good: Rollout
    ) -> None:
        broken = replace(good, result=RolloutResult.BROKE_DOWN)
        assert isinstance(validation.judge(actions, broken, target), Revise)

    def test_another_target_approves_nothing(
        self, validation: Validation, actions: ActionSet, target: State, good: Rollout
    ) -> None:
        assert isinstance(validation.judge(actions, good, replace(target, name="elsewhere")), Revise)

    def test_judging_twice_says_the_same(
        self, validation: Validation, actions: ActionSet, target: State, good: Rollout, bad: Rollout
    ) -> None:
        for rollout in (good, bad):
            assert validation.judge(actions, rollout, target) == validation.judge(actions, rollout, target)
