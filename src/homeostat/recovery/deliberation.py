"""Deliberation: plan, act, simulate, validate, release and reprompt until something is released."""

import asyncio
from dataclasses import replace

from homeostat.agents.checks import closed_finding, repetition_finding
from homeostat.agents.roles import Agents, Approved, NoAdmissiblePlan, Proposer, Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.events.recovery import Attempted
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.verdict import Approve, Revise, Rollout
from homeostat.recovery.intervention import InterventionPolicy
from homeostat.recovery.releasing import Refused, Releasing, Taken
from homeostat.recovery.scene import Scene


class Deliberation:
    """One proposer's attempts."""

    def __init__(
        self,
        scene: Scene,
        agents: Agents,
        machine: StateMachine,
        releasing: Releasing,
        policy: InterventionPolicy,
        improvements: int,
    ) -> None:
        """``policy`` and ``improvements``, the most proposals, count where the plant may also be left alone."""
        self._scene, self._agents, self._machine = scene, agents, machine
        self._releasing, self._policy, self._improvements = releasing, policy, improvements

    async def deliberate(self, proposer: Proposer, situation: Situation, idle: Rollout | None, end: float) -> Taken:
        """Propose until something is released; a refusal teaches the next attempt whoever refused.

        Where the plant may also be left as it is (``idle`` is that rollout), only what produces clearly more will do.
        ``end``: time of the event loop at which thinking ends [s]; a release that was begun is ended.
        """
        advice = Advice()
        most = proposer.attempts if idle is None else self._improvements
        for number in range(1, most + 1):
            async with asyncio.timeout_at(end):
                situation = await self._scene.fresh(situation)
                attempt, rollout = await self._attempt(number, proposer, situation, advice)
            self._scene.record(Attempted.of(proposer.name, attempt))
            if isinstance(attempt.verdict, Approve):
                # Nothing else is approved.
                assert attempt.path is not None and attempt.actions is not None and rollout is not None
                if idle is not None and not self._policy.gains(idle, rollout, self._risk_added(attempt.path)):
                    refused = (*advice.refused_paths, attempt.path.commanded)
                    advice = Advice(refused_paths=refused, attempts=(*advice.attempts, attempt))
                    continue
                found = Approved(attempt.actions, attempt.path, attempt.verdict, proposer.name)
                try:
                    return await self._releasing.release(found, situation.diagnosis)
                except Refused as refusal:
                    attempt = replace(attempt, verdict=Revise(refusal.findings))
            async with asyncio.timeout_at(end):
                after = await proposer.reprompting.advise(situation, attempt, advice)
            advice = replace(after, attempts=(*advice.attempts, attempt))
        if idle is not None:
            raise NoAdmissiblePlan(f"{proposer.name}: nothing clearly better than leaving the plant alone")
        raise NoAdmissiblePlan(f"{proposer.name}: no proposal was approved in {most} attempts")

    async def _attempt(
        self, number: int, proposer: Proposer, situation: Situation, advice: Advice
    ) -> tuple[Attempt, Rollout | None]:
        """One proposal as far as it gets, and its rollout where it gets that far."""
        kept = advice.keep_path
        path = kept if kept and self._open(kept, situation) else await proposer.planning.plan(situation, advice)
        if isinstance(path, Revise):
            return Attempt(number, None, None, path), None
        if not self._open(path, situation):
            raise NoAdmissiblePlan(f"{proposer.name}: {' > '.join(path.states)} is not open now")
        actions = await proposer.action.act(situation, path, advice)
        if isinstance(actions, Revise):
            return Attempt(number, path, None, actions), None
        for before in advice.attempts:
            if before.actions is not None and before.actions.digest == actions.digest:
                return Attempt(number, path, actions, Revise((repetition_finding(before.number),))), None
        situation = await self._scene.fresh(situation)
        if not self._open(path, situation):  # a guard closed while somebody thought about the commands
            return Attempt(number, path, None, Revise((closed_finding(path.states),))), None
        rollout = await self._agents.simulation.roll_out(situation.diagnosis, actions)
        verdict = self._agents.validation.judge(actions, rollout, self._machine.state(path.target), path)
        return Attempt(number, path, actions, verdict, len(rollout.weights)), rollout

    def _open(self, path: RecoveryPath, situation: Situation) -> bool:
        """Whether the machine lets the plant take ``path`` now, which no proposer is trusted with."""
        values = situation.snapshot.values
        return (
            path.machine == self._machine
            and path.states[0] == situation.state
            and self._machine.state(path.target).recovery_target
            and all(t.guard.holds(values) for t in path.decisions)
        )

    def _risk_added(self, path: RecoveryPath) -> int:
        """By how many ranks ``path`` is riskier than what follows if nobody interferes."""
        left = (self._scene.now.state, *self._scene.now.rest.states)
        most = [max(self._machine.state(name).risk for name in states) for states in (path.commanded, left)]
        return max(most[0] - most[1], 0)
