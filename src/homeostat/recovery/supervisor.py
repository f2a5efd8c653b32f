"""The framework's figure: monitor, diagnose, predict no action, arm the fallback, deliberate, release or fall back."""

import asyncio
from dataclasses import replace

from homeostat.agents.certificates import Course
from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Agents, NoAdmissiblePlan
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.deviations import Deviated, Strayed
from homeostat.domain.events.recovery import Concluded, Diagnosed, FaultsEnded, Noticed
from homeostat.domain.ports import Desk
from homeostat.domain.verdict import Approve, FallbackNeeded, NoActionNeeded, Released, Resolution, Verdict
from homeostat.journal.events import Trace
from homeostat.recovery.agenda import Agenda, RecoveryMemory, Stance
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.arming import Arming, TimeLeft
from homeostat.recovery.endings import fall_back, nothing_is_known, stand_down, take_no_action
from homeostat.recovery.intervention import InterventionPolicy
from homeostat.recovery.judging import Judging
from homeostat.recovery.look.doubts import Doubts
from homeostat.recovery.look.missed import MissedCriteria
from homeostat.recovery.look.news import Look
from homeostat.recovery.look.prospect import Prospect
from homeostat.recovery.look.watch import Watch
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.probing import Probes
from homeostat.recovery.progress import ProgressMonitor
from homeostat.recovery.proposals import Proposals
from homeostat.recovery.release_check import Check
from homeostat.recovery.releasing import Releasing, Withdrawn
from homeostat.recovery.scene import Scene
from homeostat.recovery.taking import Taking
from homeostat.recovery.waits import Waits


class RecoveryLoop:
    """Watches what the guard sees; every fault that monitoring reports gets one bounded recovery."""

    def __init__(
        self, desk: Desk, agents: Agents, rules: PlantRules, check: Check, bounds: Bounds, trace: Trace
    ) -> None:
        """Wire the parts together; nothing happens before :meth:`supervise`."""
        self._desk, self._diagnosis_s, self._every_step = desk, bounds.budget.diagnosis_s, bounds.every_step
        self._pricing = pricing = Pricing(rules.prices, rules.limits, rules.scales)
        self._policy = InterventionPolicy(rules.limits, pricing, rules.scales)
        self._scene = scene = Scene(desk, agents.simulation, agents.grounding, trace)
        self._watch, self._missed = Watch(agents.monitoring), MissedCriteria(rules.limits.asking)
        self._progress = ProgressMonitor(bounds.intervention.slack_s, bounds.intervention.repeat_s)
        self._prospect = Prospect(scene, agents, rules, self._progress, bounds)
        self._doubts = Doubts(scene, self._prospect, rules)
        self._arming = Arming(scene, agents.simulation, rules, bounds.budget)
        self._probes = Probes(scene, agents, rules, check, self._progress, bounds)
        self._waits = Waits(scene, bounds.intervention.waits)
        judging = Judging(scene, agents, rules, bounds, self._probes, self._waits)
        releasing, again_s = Releasing(scene, check, bounds.budget, rules.limits), bounds.intervention.back_s
        taking = Taking(scene, releasing, self._probes, self._waits, again_s)
        self._proposals = Proposals(scene, agents, rules, judging, taking, bounds)
        self._agenda, self._memory = Agenda(rules.machine, bounds), RecoveryMemory()

    async def supervise(self) -> None:
        """Watch until there is nothing more to see; attend to what is noticed, deviates or is due, until it is done."""
        while (seen := await self._desk.next()) is not None:
            self._scene.take((seen,))
            self._progress.follow(seen)
            noticed = self._watch.notices(seen.sample)
            missed = self._missed.follow(seen)
            if self._watch.stands_back(seen):
                self._probes.drop()
                self._waits.drop()
                self._memory = replace(self._memory, unanswered=False, missed=None, unwritten=None)
                continue
            if missed is not None:
                self._memory = replace(self._memory, missed=missed)
            self._doubts.follow(self._watch.symptoms)
            if noticed and not self._agenda.settled(self._memory, self._scene.now.state, self._watch.symptoms):
                self._memory = replace(self._memory, unanswered=True)
            if self._desk.behind:  # what passed while somebody thought is watched first
                continue
            deviation = await self._prospect.deviation(seen)
            due = self._is_due()
            if self._memory.unanswered or deviation is not None or due:
                self._memory = replace(self._memory, unanswered=True)
                done = await self._desk.think(self.attend(deviation))
                self._memory = replace(self._memory, unanswered=not done)

    async def attend(self, deviation: Deviated | Strayed | None) -> None:
        """Find out what is wrong, and recover if anything is, or the plant deviates; it runs on meanwhile."""
        scene, deviates = self._scene, deviation is not None
        try:
            scene.record(Noticed(tuple(s.rule for s in self._watch.symptoms)))
            self._doubts.notice(self._watch.symptoms)
            for reason in (deviation, self._memory.missed):
                if reason is not None:
                    scene.record(reason)
            try:
                diagnosis = await self._watch.diagnose(deviates, self._desk.wall_s(self._diagnosis_s))
            except TimeoutError:
                self._probes.look_in_vain()
                self._thought_through()
                return nothing_is_known(scene, self._diagnosis_s)
            scene.well("diagnosis")
            if not (diagnosis.news or deviates or scene.now.act_by_s is not None or self._is_due()):
                return scene.record(Concluded("nothing is known that was not known before"))
            if diagnosis.faulty:
                scene.record(Diagnosed.of(diagnosis), diagnosis.at_s)
            if diagnosis.ended_s is not None:
                scene.record(FaultsEnded(diagnosis.ended, diagnosis.ended_s))
                self._proposals.passed(diagnosis.ended)
            self._doubts.tell(diagnosis)
            self._memory = self._agenda.after_diagnosis(self._memory, diagnosis, scene)
            over = self._waits.end(diagnosis), self._probes.end(diagnosis)
            probed, waited = any(e.held for e in over), any(e.whole for e in over)
            due = any(e.waited for e in over) or diagnosis.ended_s is not None or self._is_asked_for()
            missed = self._memory.missed is not None
            if diagnosis.symptoms or diagnosis.faulty or deviates or due or missed or scene.now.act_by_s is not None:
                self._memory = replace(self._memory, unwritten=None)
                outcome = await self.recover(diagnosis, deviates, probed, waited)
                self._thought_through()
                if isinstance(outcome, FallbackNeeded) and not scene.now.mode.alone:
                    self._memory = replace(self._memory, unwritten=scene.now.mode)
                released = isinstance(outcome, Released)
                acts = diagnosis.faulty or ((deviates or diagnosis.symptoms or missed) and released)
                if acts and not isinstance(outcome, FallbackNeeded):  # that may still be overtaken until it has acted
                    self._watch.follow(outcome)
                await self._doubts.escalate(diagnosis, outcome, self._watch.symptoms)
            else:
                self._memory = replace(self._memory, unwritten=None)
                scene.record(Concluded("nothing is wrong, and nothing is asked for"))
        finally:
            scene.flush()

    def _is_due(self) -> bool:
        """Whether the plant is to be looked at although nothing new was seen."""
        over = self._probes.due(self._scene.seen_s) or self._waits.due(self._scene.seen_s)
        raised = self._agenda.mode_is_raised(self._memory, self._scene)
        return over or raised or self._memory.missed is not None or self._is_asked_for()

    def _thought_through(self) -> None:
        """Nothing asks for an improvement any more until it is missed for as long again."""
        self._memory = replace(self._memory, missed=None)
        self._missed.forget()

    def _is_asked_for(self) -> bool:
        """Whether a step is asked for, or the way back."""
        memory, scene = self._memory, self._scene
        return self._agenda.step_is_due(memory, scene) or self._agenda.way_back_is_due(memory, scene)

    async def recover(
        self, diagnosis: Diagnosis, deviates: bool, probed: bool = False, waited: bool = False
    ) -> Resolution:
        """Release a validated action set within the time that physics leaves, leave the plant alone, or fall back.

        ``probed``: the plant stands where a test move or a hold has brought it, which is nowhere to stay without a
        reason; ``waited``: it is looked at because a wait is over, so that the time that is left is known anew.
        """
        began, scene, agenda = asyncio.get_running_loop().time(), self._scene, self._agenda
        try:
            idle = await self._prospect.without_action(diagnosis)
        except TimeoutError as late:
            return await fall_back(scene, str(late))
        armed = await self._arming.arm(diagnosis, idle, anew=waited)
        verdict = self._prospect.judge(idle)
        look = self._policy.look(scene.now, diagnosis, idle, verdict)
        if due := agenda.step_is_due(self._memory, scene):
            self._memory = replace(self._memory, asked=(look.state, scene.seen_s))
        if back := agenda.way_back_is_due(self._memory, scene):
            self._memory = agenda.after_asking_back(self._memory, scene)
        stance = agenda.stance(self._memory, look, due or back or probed, deviates, self._policy.worthwhile(look))
        reason, ran_out = "the batch is over, and what follows violates a limit", False
        if stance.asks:
            situation = scene.situation(diagnosis, verdict.findings, armed.left_s, look.cost)
            first = None if armed.fallback is None else armed.fallback.strategy
            situation = replace(situation, act_by_s=armed.act_by_s, fallback=first)
            given = self._given(stance, look, verdict, armed)
            begun = await self._probes.begin(situation, idle, given.anew(), began)
            if begun is not None:
                self._prospect.forget()
                return begun
            situation = replace(situation, tests=self._probes.offered, optional=stance is Stance.IMPROVE)
            try:
                taken = await self._proposals.ask(situation, given, began)
            except (TimeoutError, NoAdmissiblePlan, Withdrawn) as failed:
                reason = str(failed) or f"no approved proposal within {armed.left_s:.1f} s"
                ran_out = isinstance(failed, TimeoutError)
                if isinstance(failed, NoAdmissiblePlan):
                    self._memory = replace(self._memory, in_vain=look)
                    if (begun := await self._probes.go_back(situation)) is not None:
                        self._prospect.forget()
                        return begun
            else:
                if isinstance(taken.outcome, NoActionNeeded):
                    if not taken.waiting:
                        self._memory = replace(self._memory, unwritten=scene.now.mode)
                        stand_down(scene, armed)
                    return taken.outcome
                assert taken.rollout is not None  # what was released was rolled out
                then, at_s = taken.outcome.actions.then, taken.outcome.at_s
                self._prospect.expect(then, taken.rollout, at_s, diagnosis)
                self._memory = agenda.after_release(self._memory, taken.outcome, diagnosis)
                return taken.outcome
        if not stance.may_be_left:
            return await fall_back(scene, reason)
        if stance is Stance.ACCEPT:
            self._memory = replace(self._memory, accepted=frozenset(s.rule for s in self._watch.symptoms))
        recurs = diagnosis.recurs if stance is Stance.AS_BEFORE else None
        return take_no_action(scene, verdict, idle, armed, ran_out, recurs)

    def _given(self, stance: Stance, look: Look, verdict: Verdict, armed: TimeLeft) -> Alternatives:
        """What may be done without a proposal: leaving the plant alone, and the fallback that acts first."""
        given: list[tuple[Alternative, Course | None]] = []
        if look.cost is not None:
            reason = "" if stance is Stance.IMPROVE else "a step is asked for, or the way back"
            if stance is Stance.ACT:
                reason = min(verdict.findings, key=lambda f: f.margin).message
            given.append((Alternative(AlternativeKind.LEAVE, look.state, look.cost, reason), None))
        first = armed.fallback
        if first is not None and first.rollout.weights:
            cost = self._pricing.of(first.rollout, first.strategy.actions.states, releases=1)
            reason = (
                "it acts where nothing else may be done" if isinstance(first.verdict, Approve) else "it does not help"
            )
            falling = Alternative(AlternativeKind.FALLBACK, first.strategy.name, cost, reason)
            given.append((falling, Course(first.strategy.actions)))
        well, prices = stance is Stance.IMPROVE and look.fine, self._pricing.prices
        return Alternatives(given, prices, well, self._every_step, stance is Stance.ACT)
