"""The framework's figure: supervise, recover; what is proposed in between is deliberation."""

from __future__ import annotations

import asyncio

from homeostat.agents.roles import Agents, NoAdmissiblePlan, Situation
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import Departed, Diagnosed, LeftAsIs, Noticed
from homeostat.domain.observation import FallBack, Observation
from homeostat.domain.ports import Desk
from homeostat.domain.verdict import Departure, HandedOver, LeftAlone, Outcome, Released, Verdict
from homeostat.journal.events import Trace
from homeostat.recovery.agenda import Agenda
from homeostat.recovery.arming import Arming
from homeostat.recovery.deliberation import Deliberation
from homeostat.recovery.intervention import InterventionPolicy
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.progress import ProgressMonitor
from homeostat.recovery.proposals import Proposals
from homeostat.recovery.prospect import Prospect
from homeostat.recovery.release_check import Check
from homeostat.recovery.releasing import Releasing, Withdrawn
from homeostat.recovery.scene import Scene
from homeostat.recovery.watch import Watch


class Supervisor:
    """Watches what the guard sees; every fault that monitoring reports gets one bounded recovery."""

    def __init__(self, desk: Desk, agents: Agents, rules: PlantRules, check: Check, bounds: Bounds, trace: Trace) -> None:
        """Wire the parts together; nothing happens before :meth:`supervise`."""
        self._desk, self._monitoring, self._diagnosis_s = desk, agents.monitoring, bounds.budget.diagnosis_s
        progress = ProgressMonitor(bounds.intervention.slack_s, bounds.intervention.repeat_s)
        self._scene = scene = Scene(desk, agents, progress, trace)
        self._watch, self._agenda = Watch(agents.monitoring), Agenda(scene, rules.machine, bounds)
        self._prospect, self._arming = Prospect(scene, rules, bounds), Arming(scene, rules, bounds)
        self._policy = InterventionPolicy(rules.limits, rules.production, rules.scales)
        deliberation = Deliberation(scene, rules, Releasing(scene, check, bounds), self._policy, bounds)
        self._proposals = Proposals(scene, deliberation, self._policy, bounds)
        self._latched = self._again = False

    async def supervise(self) -> None:
        """Watch until there is nothing more to see; think about what monitoring reports and what does not go on."""
        while (observation := await self._desk.next()) is not None:
            self._scene.take((observation,))
            noticed = self._watch.notices(observation.sample)
            if self._stands_back(observation):
                continue
            self._again = self._again or (noticed and not self._agenda.settled)
            if self._desk.behind:  # what passed while somebody thought is watched first
                continue
            departure = await self._prospect.departure(observation)
            if self._again or departure is not None or self._agenda.step_is_due:
                self._again = True  # until it has come to its end
                self._again = not await self._desk.think(self._attend(departure))

    async def recover(self, diagnosis: Diagnosis) -> Outcome:
        """Release a validated action set within the time that physics leaves, leave the plant alone, or hand over."""
        began = asyncio.get_running_loop().time()
        agenda, policy = self._agenda, self._policy
        try:
            idle = await self._prospect.idle(diagnosis)
        except TimeoutError as late:
            return await self._hand_over(str(late))
        limit_s = await self._arming.arm(diagnosis, idle)
        verdict = self._prospect.judge(idle)
        fine, harmless = policy.fine(verdict, agenda.recovered), policy.harmless(verdict)
        if due := agenda.step_is_due:
            agenda.note_asked()
        if fine and agenda.calm(diagnosis) and not due:
            return self._leave_alone(verdict)
        if agenda.finished:  # nobody can propose anything: what matters is that no limit is violated
            if not (fine or harmless):
                return await self._hand_over("the batch is over, and what follows violates a limit")
            agenda.note_accepted()
            return self._leave_alone(verdict)
        try:
            situation = self._situation(diagnosis, verdict, limit_s)
            outcome = await self._proposals.ask(situation, idle if fine and not due else None, began)
        except (TimeoutError, NoAdmissiblePlan, Withdrawn) as reason:
            if fine or (agenda.recovered and harmless):
                return self._leave_alone(verdict)
            return await self._hand_over(str(reason) or f"no approved proposal within {limit_s:.1f} s")
        if isinstance(outcome, Released):
            agenda.note_released(outcome, diagnosis)
        return outcome

    async def _attend(self, departure: Departure | None) -> None:
        """Find out what is wrong, and recover if anything is; the plant runs on meanwhile.

        Where the batch departs from its prediction, it is judged again although no fault explains why.
        """
        scene, departed = self._scene, departure is not None
        self._arming.begin()
        try:
            scene.record(Noticed(tuple(s.rule for s in self._monitoring.symptoms)))
            if departure is not None:
                scene.record(Departed.of(departure, scene.now.state))
            diagnosis = await self._diagnose(departed)
            if diagnosis is None:
                return
            if diagnosis.faulty:
                scene.record(Diagnosed.of(diagnosis), diagnosis.at_s)
            if diagnosis.faulty or departed or self._agenda.step_is_due or self._arming.stands:
                outcome = await self.recover(diagnosis)
                if isinstance(outcome, HandedOver):
                    return  # until the fallback has acted it may still be overtaken
                if isinstance(outcome, LeftAlone):
                    self._arming.relax()
                if diagnosis.faulty or (departed and isinstance(outcome, Released)):
                    self._monitoring.follow(outcome)
        finally:
            scene.flush()

    async def _diagnose(self, departed: bool) -> Diagnosis | None:
        """What is believed to be wrong; None where that takes too long, and nothing counts as known."""
        limit_s = self._diagnosis_s
        try:
            return await self._watch.diagnose(departed, self._desk.wall_s(limit_s))
        except TimeoutError:
            self._arming.as_in_tables()
            self._scene.alarm("diagnosis", f"the diagnosis took longer than {limit_s:g} s; nothing counts as known")
            return None

    def _stands_back(self, observation: Observation) -> bool:
        """Whether a fallback has acted and nobody has reset it; monitoring is told once of either."""
        before, self._latched = self._latched, observation.latched is not None
        if observation.latched is not None:
            self._again = False
            self._watch.forget()
            if not before:
                self._monitoring.follow(HandedOver(observation.latched, observation.now_s))
        elif before:
            self._monitoring.follow(LeftAlone(observation.now_s, 0.0))
        return self._latched

    def _situation(self, diagnosis: Diagnosis, verdict: Verdict, limit_s: float) -> Situation:
        """What proposers are asked about: the plant now, and what they have time for [s]."""
        scene, now = self._scene, self._scene.now
        return Situation(
            scene.snapshot, diagnosis, now.state, scene.recent, verdict.findings, limit_s, now.way, now.rest.commands
        )

    def _leave_alone(self, verdict: Verdict) -> LeftAlone:
        """Note by which margin the plant does without help."""
        worst = min(f.margin for f in verdict.findings)
        self._scene.record(LeftAsIs(self._scene.now.state, worst))
        return LeftAlone(self._scene.seen_s, worst)

    async def _hand_over(self, reason: str) -> HandedOver:
        """Ask for the fallback; the time that was thought passes first."""
        await self._scene.look()
        self._desk.put(FallBack(reason))
        return HandedOver(reason, self._scene.seen_s)
