"""Proposals: proposers compete within their time, and the cheapest of what was approved is released."""

from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Agents, NoAdmissiblePlan, Situation
from homeostat.domain.events.recovery import GaveUp
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.deliberation import Deliberation
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.release_check import Check
from homeostat.recovery.releasing import Overtaken, Refused, Releasing, Taken
from homeostat.recovery.scene import Scene


class Proposals:
    """Asks the proposers, and has the best of what they found released."""

    def __init__(self, scene: Scene, agents: Agents, rules: PlantRules, check: Check, bounds: Bounds) -> None:
        """``check`` seals what is released."""
        self._scene, self._agents, self._machine = scene, agents, rules.machine
        self._pricing = Pricing(rules.prices, rules.limits, rules.scales)
        self._releasing = Releasing(scene, check, bounds.budget)
        self._improvements = bounds.intervention.improvements

    async def ask(self, situation: Situation, alternatives: Alternatives, began: float) -> Taken:
        """Ask the proposers one after the other, and release the cheapest of what was approved.

        The time counts from ``began``, by the event loop's clock, when the plant was looked at [s]. Where the plant may
        also be left alone, only those are asked whose business it is to improve, and only what costs less is released.

        Raises:
            NoAdmissiblePlan: nobody has anything to propose, or nothing that costs less than leaving the plant alone.
            TimeoutError: the time is over.
            Withdrawn: what was asked for last was given up.
        """
        end = self._scene.end(began, situation.deadline_s)
        while True:
            try:
                return await self._compete(situation, alternatives, end)
            except Overtaken:  # the plant went on to another state: whatever was found begins in the former one
                alternatives = alternatives.anew()
                situation = await self._scene.fresh(situation)

    async def _compete(self, situation: Situation, alternatives: Alternatives, end: float) -> Taken:
        """As :meth:`ask`, of a plant that stays in its state; Overtaken where it does not."""
        every = self._sessions(alternatives)
        asked, reason = [*every], Exception()
        while True:
            for session in asked:
                if alternatives.worth_waiting:
                    reason = await self._propose(session, alternatives, situation, end) or reason
            best = alternatives.best
            if best is None:
                self._scene.record(alternatives.event(""))
                if alternatives.leave is not None and not isinstance(reason, TimeoutError):
                    raise NoAdmissiblePlan("nothing costs less than leaving the plant alone")
                raise reason if asked or every else NoAdmissiblePlan("nobody proposes anything")
            self._scene.record(alternatives.event(best.actions.digest))
            try:
                return await self._releasing.release(best, situation.diagnosis)
            except Refused as refusal:
                reason = NoAdmissiblePlan(f"{best.proposer}: {refusal}")
                alternatives.refuse(best, str(refusal))
                asked = [s for s in every if s.proposer.name == best.proposer]
                await asked[0].refused(best, refusal.findings, situation, end)

    async def _propose(
        self, session: Deliberation, alternatives: Alternatives, situation: Situation, end: float
    ) -> Exception | None:
        """Let one proposer add to the ``alternatives``; why it gave up, None where it did not."""
        found = alternatives.best is not None
        name = session.proposer.name
        if found and alternatives.leave is None:  # what waits gets worse: half of the time is kept to release it in
            end -= 0.5 * self._scene.wall_s(situation.deadline_s)
        failed: Exception
        try:
            await session.add_to(alternatives, situation, end)
            return None
        except TimeoutError as late:
            failed, text = late, str(late) or f"{name}: no approved proposal in the time that was left for it"
        except NoAdmissiblePlan as nothing:
            failed, text = nothing, str(nothing)
        except Exception as broken:  # a proposer may be anybody's: one that breaks is not the last that is asked
            failed, text = broken, f"{name} failed: {broken!r}"
        self._scene.record(GaveUp(name, text))
        return failed

    def _sessions(self, alternatives: Alternatives) -> list[Deliberation]:
        """One for every proposer that is asked."""
        leave = alternatives.leave is not None
        return [
            Deliberation(
                p,
                self._scene,
                self._agents,
                self._machine,
                self._pricing,
                min(p.attempts, self._improvements) if leave else p.attempts,
            )
            for p in self._agents.proposers
            if not leave or p.improves
        ]
