"""Deliberation: plan, act, simulate, validate and reprompt; what is approved joins the alternatives."""

import asyncio
from dataclasses import replace

from homeostat.agents.checks import closed_finding, repetition_finding
from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Agents, Approved, NoAdmissiblePlan, Proposer, Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.events.recovery import Attempted, Remarked
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.quotation import quote
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.remark import RemarkKind
from homeostat.domain.verdict import Approve, Finding, Revise
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.scene import Scene


class Deliberation:
    """One proposer's attempts in one recovery."""

    def __init__(
        self, proposer: Proposer, scene: Scene, agents: Agents, machine: StateMachine, pricing: Pricing, most: int
    ) -> None:
        """``most``: attempts that it has."""
        self.proposer = proposer
        self._scene, self._agents, self._machine, self._pricing = scene, agents, machine, pricing
        self._advice, self._number, self._most = Advice(), 0, most

    async def add_to(self, alternatives: Alternatives, situation: Situation, end: float, soon: float) -> None:
        """Propose until something is approved, a thorough proposer until nothing cheaper can be found.

        The numbers of one that is not thorough are bettered by the search, where that finds cheaper ones on the same
        path. ``end``: time of the event loop at which thinking ends, ``soon``: at which it does where anything is
        approved [s]. NoAdmissiblePlan and TimeoutError where nothing was found.
        """
        found = False
        while self._number < self._most:
            try:
                async with asyncio.timeout_at(end if alternatives.best is None else min(end, soon)):
                    situation = await self._scene.fresh(situation)
                    try:
                        attempt = await self._attempt(self._number + 1, situation)
                    finally:
                        self._tell()
                    self._number += 1
                    if not (taken := self._take(attempt, alternatives)):
                        await self._reprompt(situation, attempt)
            except (NoAdmissiblePlan, TimeoutError):
                if found:
                    return
                raise
            found = found or taken
            if taken and not self.proposer.thorough:
                return await self._polish(attempt, alternatives, situation, min(end, soon))
        if not found:
            raise NoAdmissiblePlan(f"{self.proposer.name}: no proposal was approved in {self._most} attempts")

    def _tell(self) -> None:
        """Record what the proposer said besides; a cause that no table lists is for a person, who is called."""
        for remark in () if self.proposer.remarks is None else self.proposer.remarks.drain():
            self._scene.record(Remarked.of(self.proposer.name, remark))
            if remark.kind is RemarkKind.UNLISTED_CAUSE:
                said = f"{self.proposer.name} suspects {remark.about}: {quote(remark.text, 200)}"
                self._scene.alarm("unlisted-cause", f"{said}; nothing was decided by it, look at {remark.about}")

    def _take(self, attempt: Attempt, alternatives: Alternatives) -> bool:
        """Record ``attempt``; whether it is approved, and one of the ``alternatives`` now."""
        name = self.proposer.name
        self._scene.record(Attempted.of(name, attempt))
        if not isinstance(attempt.verdict, Approve):
            return False
        # Nothing else is approved.
        assert attempt.path is not None and attempt.actions is not None and attempt.cost is not None
        alternatives.add(Approved(attempt.actions, attempt.path, attempt.verdict, name, attempt.cost, attempt.polished))
        refused = (*self._advice.refused_paths, attempt.path.commanded)
        self._advice = Advice(refused_paths=refused, attempts=(*self._advice.attempts, attempt))
        return True

    async def _polish(self, attempt: Attempt, alternatives: Alternatives, situation: Situation, end: float) -> None:
        """Let the search better the numbers of an approved ``attempt``; where time is over it stands as it is."""
        polishing, path, actions = self._agents.polishing, attempt.path, attempt.actions
        if polishing is None or path is None or actions is None:
            return
        try:
            async with asyncio.timeout_at(end):
                better = await polishing.polish(situation, path, actions)
                if better.digest == actions.digest:
                    return
                polished = await self._judged(attempt.number, situation, path, better)
        except (NoAdmissiblePlan, TimeoutError):
            return
        self._take(replace(polished, polished=True), alternatives)

    async def refused(self, found: Approved, findings: tuple[Finding, ...], situation: Situation, end: float) -> None:
        """Teach the next attempt what the release check or the guard said of what was ``found``."""
        before, states = self._advice, found.path.commanded
        attempt = next(a for a in before.attempts if a.actions == found.actions)
        self._advice = replace(
            before,
            refused_paths=tuple(p for p in before.refused_paths if p != states),
            attempts=tuple(a for a in before.attempts if a is not attempt),
        )
        async with asyncio.timeout_at(end):
            await self._reprompt(situation, replace(attempt, verdict=Revise(findings)))

    async def _reprompt(self, situation: Situation, attempt: Attempt) -> None:
        after = await self.proposer.reprompting.advise(situation, attempt, self._advice)
        self._advice = replace(after, attempts=(*self._advice.attempts, attempt))

    async def _attempt(self, number: int, situation: Situation) -> Attempt:
        """One proposal as far as it gets."""
        proposer, advice = self.proposer, self._advice
        kept = advice.keep_path
        path = kept if kept and self._open(kept, situation) else await proposer.planning.plan(situation, advice)
        if isinstance(path, Revise):
            return Attempt(number, None, None, path)
        if not self._open(path, situation):
            raise NoAdmissiblePlan(f"{proposer.name}: {' > '.join(path.states)} is not open now")
        actions = await proposer.action.act(situation, path, advice)
        if isinstance(actions, Revise):
            return Attempt(number, path, None, actions)
        for before in advice.attempts:
            if before.actions is not None and before.actions.digest == actions.digest:
                return Attempt(number, path, actions, Revise((repetition_finding(before.number),)))
        situation = await self._scene.fresh(situation)
        if not self._open(path, situation):  # a guard closed while somebody thought about the commands
            return Attempt(number, path, None, Revise((closed_finding(path.states),)))
        return await self._judged(number, situation, path, actions)

    async def _judged(self, number: int, situation: Situation, path: RecoveryPath, actions: ActionSet) -> Attempt:
        """``actions`` tried on the twin, judged and priced."""
        rollout = await self._agents.simulation.roll_out(situation.diagnosis, actions)
        verdict = self._agents.validation.judge(actions, rollout, self._machine.state(path.target), path)
        cost = self._pricing.of(rollout, actions.states, releases=1) if rollout.weights else None
        return Attempt(number, path, actions, verdict, len(rollout.weights), cost)

    def _open(self, path: RecoveryPath, situation: Situation) -> bool:
        """Whether the machine lets the plant take ``path`` now, which no proposer is trusted with."""
        values = situation.snapshot.values
        return (
            path.machine == self._machine
            and path.states[0] == situation.state
            and self._machine.state(path.target).recovery_target
            and all(t.guard.holds(values) for t in path.decisions)
        )
