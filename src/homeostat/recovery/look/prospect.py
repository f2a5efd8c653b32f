"""Prospect: what happens if nobody interferes, and whether the plant does what was predicted of it."""

import math
from dataclasses import replace

from homeostat.agents.roles import Agents
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.deviations import Deviated, Strayed
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.observation import Observation
from homeostat.domain.recovery import Step
from homeostat.domain.verdict import Rollout, Verdict
from homeostat.recovery.look.band import Band
from homeostat.recovery.look.foresight import foreseen
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.progress import ProgressMonitor
from homeostat.recovery.scene import Scene


class Prospect:
    """Rolls out what is left of the sequence; the steps that the guard takes and the margins are compared with that."""

    def __init__(
        self, scene: Scene, agents: Agents, rules: PlantRules, progress: ProgressMonitor, bounds: Bounds
    ) -> None:
        """``progress`` is told what is predicted; ``bounds`` say how long the twin may take."""
        self._scene, self._agents, self._machine, self._progress = scene, agents, rules.machine, progress
        self._limits = rules.limits
        self._band = Band(rules.limits.hard, rules.scales, bounds.intervention)
        self._limit_s, self._repeat_s = bounds.budget.arming_s, bounds.intervention.repeat_s
        self._again_s = -math.inf
        self.foreseen: Foreseen | None = None
        """What happens if nothing is done, as it was foreseen last; None where nobody has looked."""

    async def deviation(self, seen: Observation) -> Deviated | Strayed | None:
        """How the plant deviates from what was predicted; a route of which nothing is predicted yet is rolled out.

        Where the twin is late, it is asked again after a while.
        """
        scene = self._scene
        if scene.ready and seen.now_s >= self._again_s and self._progress.lacks(seen.rest.then):  # the nominal route
            self._agents.simulation.observe(scene.recent)
            healthy = Diagnosis(seen.now_s, (), ())
            try:
                await scene.within("the prediction", self._limit_s, self._roll_out(healthy))
            except TimeoutError as late:
                scene.alarm("prediction", f"{late}; no step is expected at any time")
                self._again_s = seen.now_s + self._repeat_s
                return None
            scene.well("prediction")
        deviation = self._progress.deviates(seen)
        if deviation is not None:
            return Deviated.of(deviation, seen.state)
        return None if seen.sample is None else self._band.strays(seen.sample)

    def expect(self, steps: tuple[Step, ...], rollout: Rollout, from_s: float, diagnosis: Diagnosis) -> None:
        """From process time ``from_s`` on the plant should do what ``rollout`` says of it and of ``steps`` [s]."""
        self._progress.expect(steps, rollout, from_s)
        errors = self._agents.simulation.instrument_errors(diagnosis) if diagnosis.faulty else ()
        self._band.expect(rollout, {tag for of_one in errors for tag in of_one})

    def forget(self) -> None:
        """No margin is expected any more, as the plant is moved in order to learn something."""
        self._band.forget()

    async def without_action(self, diagnosis: Diagnosis) -> Rollout:
        """Take a fresh look at the plant; what happens if nothing is done. TimeoutError where the twin is late."""
        idle = await self._scene.within("the prediction", self._limit_s, self._look_ahead(diagnosis))
        self.foreseen = foreseen(idle, self._limits)
        self._scene.record(self.foreseen)
        return idle

    async def if_it_is(self, diagnosis: Diagnosis) -> Foreseen | None:
        """What happens if nothing is done and what is in doubt is so; None where nothing is, or the twin is late.

        The unknown ones among what is in doubt persist and grow as the settings say. Nothing of it is expected.
        """
        faults = [h for h in diagnosis.hypotheses if h.faults and not h.something_else]
        total = sum(h.probability for h in faults)
        if not total:
            return None
        supposed = replace(diagnosis, hypotheses=tuple(replace(h, probability=h.probability / total) for h in faults))
        rollout = self._agents.simulation.roll_out(replace(supposed, doubts=False), self._scene.now.rest)
        try:
            told = await self._scene.within("the prediction", self._limit_s, rollout)
        except TimeoutError:
            return None
        return foreseen(told, self._limits)

    def judge(self, idle: Rollout) -> Verdict:
        """What follows if nobody interferes: the steps that are left, if any."""
        now = self._scene.now
        return self._agents.validation.judge(now.rest, idle, self._machine.state(now.rest.end), now.way)

    async def _look_ahead(self, diagnosis: Diagnosis) -> Rollout:
        await self._scene.look()
        return await self._roll_out(diagnosis)

    async def _roll_out(self, diagnosis: Diagnosis) -> Rollout:
        """What the plant does by itself from now on, which is expected of it then."""
        now = self._scene.now
        rollout = await self._agents.simulation.roll_out(diagnosis, now.rest)
        self.expect(now.rest.then, rollout, now.now_s, diagnosis)
        return rollout
