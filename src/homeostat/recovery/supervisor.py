"""The framework's figure: supervise, recover; what is proposed in between is deliberation."""

from __future__ import annotations

import asyncio
import math

from homeostat.agents.crew import Crew, NoAdmissiblePlan, Situation
from homeostat.agents.planning import EVENT
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.observation import FallBack, Observation
from homeostat.domain.ports import Desk
from homeostat.domain.verdict import Departure, HandedOver, LeftAlone, Outcome, Released, Rollout, Verdict
from homeostat.recovery.arming import Arming
from homeostat.recovery.deliberation import Deliberation
from homeostat.recovery.intervention import InterventionPolicy
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.progress import ProgressMonitor
from homeostat.recovery.proposals import Proposals
from homeostat.recovery.release_check import Check
from homeostat.recovery.releasing import Releasing, Withdrawn
from homeostat.recovery.scene import Scene
from homeostat.recovery.watch import Watch
from homeostat.trace.decisions import Departed, Diagnosed, LeftAsIs, Noticed
from homeostat.trace.events import Trace

FIRST_LOOK = 5
"""Snapshots that the twin needs before it predicts the nominal route."""


class Supervisor:
    """Watches what the guard sees; every fault that monitoring reports gets one bounded recovery."""

    def __init__(self, desk: Desk, crew: Crew, rules: PlantRules, check: Check, bounds: Bounds, trace: Trace) -> None:
        """Wire the parts together; nothing happens before :meth:`supervise`."""
        self._desk, self._crew, self._rules, self._bounds = desk, crew, rules, bounds
        self._progress = ProgressMonitor(bounds.patience.slack_s, bounds.patience.repeat_s)
        self._scene = Scene(desk, crew, self._progress, trace)
        self._watch = Watch(crew.monitoring)
        self._arming = Arming(self._scene, rules, bounds)
        self._policy = InterventionPolicy(rules.limits, rules.production, rules.scales)
        deliberation = Deliberation(
            self._scene, rules, Releasing(self._scene, check, bounds), self._policy, bounds
        )  # fmt: skip
        self._proposals = Proposals(self._scene, deliberation, self._policy, bounds)
        self._accepted: frozenset[str] = frozenset()
        self._asked = "", -math.inf
        self._released_s = math.inf
        self._latched = self._again = False

    async def supervise(self) -> None:
        """Watch until there is nothing more to see; think about what monitoring reports and what does not go on."""
        while (observation := await self._desk.next()) is not None:
            self._scene.take((observation,))
            noticed = self._watch.notices(observation.sample)
            if self._stands_back(observation):
                continue
            self._again = self._again or (noticed and not self._judged)
            if self._desk.behind:  # what passed while somebody thought is watched first
                continue
            departure = await self._departure(observation)
            if self._again or departure is not None or self._step_is_due:
                self._again = True  # until it has come to its end
                self._again = not await self._desk.think(self._attend(departure))

    async def recover(self, diagnosis: Diagnosis) -> Outcome:
        """Release a validated action set within the time that physics leaves, leave the plant alone, or hand over."""
        began = asyncio.get_running_loop().time()
        scene, policy = self._scene, self._policy
        try:
            idle = await scene.within("the prediction", self._bounds.budget.arming_s, self._idle(diagnosis))
        except TimeoutError as late:
            return await self._hand_over(str(late))
        limit_s = await self._arming.arm(diagnosis, idle)
        verdict = self._judge_idle(idle)
        fine = policy.fine(verdict, self._recovered)
        if due := self._step_is_due:
            self._asked = scene.now.state, scene.seen_s
        calm = not diagnosis.faulty or scene.seen_s - self._released_s < self._bounds.patience.calm_s
        if fine and calm and not due:
            return self._leave_alone(verdict)
        if self._finished:  # nobody can propose anything: what matters is that no limit is violated
            if not (fine or policy.harmless(verdict)):
                return await self._hand_over("the batch is over, and what follows violates a limit")
            self._accepted = self._rules_active
            return self._leave_alone(verdict)
        situation = Situation(
            scene.snapshot, diagnosis, scene.now.state, scene.recent, verdict.findings, limit_s, scene.now.way,
            scene.now.rest.commands,
        )  # fmt: skip
        try:
            outcome = await self._proposals.ask(situation, idle if fine and not due else None, began)
        except (TimeoutError, NoAdmissiblePlan, Withdrawn) as reason:
            if fine or (self._recovered and policy.harmless(verdict)):
                return self._leave_alone(verdict)
            return await self._hand_over(str(reason) or f"no approved proposal within {limit_s:.1f} s")
        if isinstance(outcome, Released) and (diagnosis.faulty or not self._bounds.every_step):
            self._released_s = outcome.at_s  # a step as usual is no recovery
        return outcome

    async def _attend(self, departure: Departure | None) -> None:
        """Find out what is wrong, and recover if anything is; the plant runs on meanwhile.

        Where the batch departs from its prediction, it is judged again although no fault explains why.
        """
        scene, monitoring = self._scene, self._crew.monitoring
        try:
            scene.record(Noticed(tuple(s.rule for s in monitoring.symptoms)))
            if departure is not None:
                scene.record(Departed.of(departure, scene.now.state))
            diagnosis = await self._diagnose(departure is not None)
            if diagnosis is None:
                return
            if diagnosis.faulty:
                scene.record(Diagnosed.of(diagnosis), diagnosis.at_s)
            if diagnosis.faulty or departure is not None or self._step_is_due:
                outcome = await self.recover(diagnosis)
                released = departure is not None and isinstance(outcome, Released)
                if not isinstance(outcome, HandedOver):
                    self._arming.relax()
                    if diagnosis.faulty or released:
                        monitoring.follow(outcome)
        finally:
            scene.flush()

    async def _diagnose(self, departed: bool) -> Diagnosis | None:
        """What is believed to be wrong; None where that takes too long, and nothing counts as known."""
        limit_s = self._bounds.budget.diagnosis_s
        try:
            return await self._watch.diagnose(departed, self._desk.wall_s(limit_s))
        except TimeoutError:
            self._arming.as_in_tables()
            self._scene.alarm("diagnosis", f"the diagnosis took longer than {limit_s:g} s; nothing counts as known")
            return None

    def _stands_back(self, observation: Observation) -> bool:
        """Whether a fallback has acted and nobody has reset it; monitoring is told once of either."""
        if observation.latched is not None and not self._latched:
            self._latched, self._again = True, False
            self._crew.monitoring.follow(HandedOver(observation.latched, observation.now_s))
        elif observation.latched is None and self._latched:
            self._latched = False
            self._crew.monitoring.follow(LeftAlone(observation.now_s, 0.0))
        return self._latched

    async def _departure(self, observation: Observation) -> Departure | None:
        """How the batch departs from what was predicted."""
        rest = observation.rest
        if self._progress.lacks(rest.then) and len(self._scene.recent) >= FIRST_LOOK:  # the nominal route
            self._crew.simulation.observe(self._scene.recent)
            healthy = Diagnosis(observation.now_s, (), ())
            work = self._crew.simulation.roll_out(healthy, rest)
            try:
                rollout = await self._scene.within("the prediction", self._bounds.budget.arming_s, work)
            except TimeoutError as late:
                self._scene.alarm("prediction", f"{late}; no step is expected at any time")
                return None
            self._progress.expect(rest.then, rollout)
        return self._progress.departs(observation)

    async def _idle(self, diagnosis: Diagnosis) -> Rollout:
        """Take a fresh look at the plant; what happens if nothing is done."""
        await self._scene.look()
        rest = self._scene.now.rest
        idle = await self._crew.simulation.roll_out(diagnosis, rest)
        self._progress.expect(rest.then, idle)
        return idle

    def _judge_idle(self, idle: Rollout) -> Verdict:
        """What follows if nobody interferes: the steps that are left, if any."""
        rest = self._scene.now.rest
        return self._crew.validation.judge(rest, idle, self._rules.machine.state(rest.end), self._scene.now.way)

    @property
    def _step_is_due(self) -> bool:
        """Whether every state is asked about, and this one was not yet, or a while ago in vain."""
        if not self._bounds.every_step or len(self._scene.recent) < FIRST_LOOK or self._finished:
            return False
        (state, at_s), scene = self._asked, self._scene
        stands = scene.now.way is None and scene.seen_s - at_s >= self._bounds.patience.repeat_s
        return scene.now.state != state or stands

    @property
    def _finished(self) -> bool:
        """Whether nothing but the fallback leads out of the present state: a batch that is complete."""
        return self._rules.machine.is_end(self._scene.now.state, EVENT)

    @property
    def _rules_active(self) -> frozenset[str]:
        """Names of the symptoms that are active."""
        return frozenset(s.rule for s in self._crew.monitoring.symptoms)

    @property
    def _judged(self) -> bool:
        """Whether the batch is over, and safe with every symptom that there is: nothing is left to review."""
        return self._finished and self._rules_active <= self._accepted

    @property
    def _recovered(self) -> bool:
        """Whether something was released before."""
        return math.isfinite(self._released_s)

    def _leave_alone(self, verdict: Verdict) -> LeftAlone:
        worst = min(f.margin for f in verdict.findings)
        self._scene.record(LeftAsIs(self._scene.now.state, worst))
        return LeftAlone(self._scene.seen_s, worst)

    async def _hand_over(self, reason: str) -> HandedOver:
        """Ask for the fallback; the time that was thought passes first."""
        await self._scene.look()
        self._desk.put(FallBack(reason))
        return HandedOver(reason, self._scene.seen_s)
