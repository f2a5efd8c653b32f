"""Proposals: one proposer after the other, each within its share of the time."""

from homeostat.agents.roles import Agents, NoAdmissiblePlan, Proposer, Situation
from homeostat.domain.events.recovery import GaveUp
from homeostat.domain.verdict import Rollout
from homeostat.recovery.deliberation import Deliberation
from homeostat.recovery.intervention import InterventionPolicy
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.release_check import Check
from homeostat.recovery.releasing import Overtaken, Releasing, Taken, Withdrawn
from homeostat.recovery.scene import Scene


class Proposals:
    """Asks the proposers until one's action set is released."""

    def __init__(
        self, scene: Scene, agents: Agents, rules: PlantRules, check: Check, policy: InterventionPolicy, bounds: Bounds
    ) -> None:
        """``check`` seals what is released; ``policy`` says what is worth doing where the plant may be left alone."""
        releasing, improvements = Releasing(scene, check, bounds.budget), bounds.intervention.improvements
        self._deliberation = Deliberation(scene, agents, rules.machine, releasing, policy, improvements)
        self._scene, self._proposers, self._policy, self._last_s = scene, agents.proposers, policy, bounds.budget.last_s

    async def ask(self, situation: Situation, idle: Rollout | None, began: float) -> Taken:
        """Ask one proposer after the other, each within its time; the last one's failure is everyone's.

        The time counts from ``began``, by the event loop's clock, when the plant was looked at [s]. Where the plant
        may also be left alone (``idle``), only those are asked whose business it is to improve.

        Raises:
            NoAdmissiblePlan: nobody has anything more to propose.
            TimeoutError: the time is over.
            Withdrawn: what was asked for last was given up.
        """
        proposers = [p for p in self._proposers if idle is None or p.improves]
        if idle is not None and not self._policy.worthwhile(idle):
            raise NoAdmissiblePlan("the plant already produces what it can")
        end = self._scene.end(began, situation.deadline_s)
        reason: Exception = NoAdmissiblePlan("nobody proposes anything")
        for proposer in proposers:
            last = proposer is proposers[-1]
            try:
                return await self._of(proposer, situation, idle, end if last else end - self._last_s)
            except TimeoutError as late:
                reason = late
                text = str(late) or f"{proposer.name}: no approved proposal in the time that was left for it"
            except (NoAdmissiblePlan, Withdrawn) as failed:
                reason, text = failed, str(failed)
            except Exception as failed:  # a proposer may be anybody's: one that breaks is not the last that is asked
                if last:
                    raise
                reason, text = failed, f"{proposer.name} failed: {failed!r}"
            self._scene.record(GaveUp(proposer.name, text))
        raise reason

    async def _of(self, proposer: Proposer, situation: Situation, idle: Rollout | None, end: float) -> Taken:
        """What ``proposer`` has released until ``end``; it begins again where the plant went on to another state."""
        while True:
            try:
                return await self._deliberation.deliberate(proposer, situation, idle, end)
            except Overtaken:
                situation = await self._scene.fresh(situation)
