"""Probing: a test move or a wait before anything is done for good, where that is worth it, safe, and time is left."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.agents.checks import judge_passing, judge_safety
from homeostat.agents.pricing import Pricing
from homeostat.agents.probing.twin_probing import CERTAIN
from homeostat.agents.roles import Agents, Approved, Probe, Probing, Situation
from homeostat.domain.advice import Attempt
from homeostat.domain.diagnosis import Diagnosis, by_fault_set
from homeostat.domain.events.recovery import Attempted, GaveUp, Probed, ProbeEnded
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Arm
from homeostat.domain.recovery import FallbackStrategy
from homeostat.domain.verdict import Approve, NoActionNeeded, Released, Resolution, Rollout
from homeostat.recovery.deadline import first_violated_s
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.progress import ProgressMonitor
from homeostat.recovery.release_check import Check
from homeostat.recovery.releasing import Overtaken, Refused, Releasing, Withdrawn
from homeostat.recovery.scene import Scene
from homeostat.twin.twin import Interruption

PROPOSER = "search"
"""Who proposes probes."""
TRIED = 3
"""Most probes that are validated in one look."""
WRITING_S = 2.0
"""What it may take until a test move is written and read back [s]."""


@dataclass(frozen=True, slots=True)
class _Admitted:
    """A probe that is safe."""

    probe: Probe
    retreat: FallbackStrategy
    """What ends it if nobody answers."""
    ended: Interruption
    """When, and how."""
    verdict: Approve


@dataclass(frozen=True, slots=True)
class _UnderWay:
    """A probe that has begun."""

    probe: Probe
    until_s: float
    """Process time at which the plant is looked at again [s]."""


class Probes:
    """Begins probes, and says when the plant is to be looked at again; forgets them when nothing is wrong any more.

    A probe is released like everything else. What makes it one is how it is judged: for as long as it lasts and the
    thinking after it may take, and then with a fallback, under every plausible explanation. Where it would violate a
    limit if it went on, the guard is told when that fallback is to act.
    """

    def __init__(
        self, scene: Scene, agents: Agents, rules: PlantRules, check: Check, progress: ProgressMonitor, bounds: Bounds
    ) -> None:
        """``check`` seals what is released; ``bounds`` say how long a probe lasts, and how many there may be."""
        self._scene, self._agents, self._rules, self._progress = scene, agents, rules, progress
        self._budget, self._bounds = bounds.budget, bounds.intervention
        self._releasing = Releasing(scene, check, bounds.budget)
        self._pricing = Pricing(rules.prices, rules.limits, rules.scales)
        self._under_way: _UnderWay | None = None
        self._begun: list[tuple[str, tuple[str, str]]] = []

    def due(self, now_s: float) -> bool:
        """Whether a probe is over and was not looked at."""
        return self._under_way is not None and now_s >= self._under_way.until_s

    def drop(self) -> None:
        """A fallback acts: nobody learns anything from the probe any more."""
        self._under_way = None

    def end(self, diagnosis: Diagnosis) -> bool:
        """Say what came of the probe that is under way, if any; whether it moved the plant."""
        if not diagnosis.faulty:
            self._begun = []
        if self._under_way is None:
            return False
        probe, self._under_way = self._under_way.probe, None
        best = by_fault_set(diagnosis.hypotheses)[:1]
        name, probability = (best[0].name, best[0].probability) if best else ("none", 1.0)
        self._scene.record(ProbeEnded(probe.apart, name, probability, probability >= CERTAIN))
        return probe.path is not None

    async def begin(self, situation: Situation, idle: Rollout, began: float) -> Resolution | None:
        """What was begun; None where nothing is worth it, safe and in time, or it was refused.

        ``idle`` is what happens without action. What is thought counts from ``began``, by the event loop's clock [s]; a
        release that was begun is ended.
        """
        probing, scene, bounds = self._agents.probing, self._scene, self._bounds
        needed_s = bounds.probe_s + bounds.answer_s + self._budget.reserve_s
        near = first_violated_s(idle, self._rules.limits) <= needed_s
        if probing is None or near or len(self._begun) >= bounds.probes or scene.now.mode is not Mode.CLOSED_LOOP:
            return None
        try:
            async with asyncio.timeout_at(scene.end(began, situation.deadline_s)):
                found = await probing.probes(situation, scene.now.rest, bounds.probe_s)
                fresh = [p for p in found if (p.actions.digest, p.apart) not in self._begun]
                chosen = await self._admitted(probing, situation, fresh[:TRIED])
                if chosen is None:
                    return None
                alone = await self._agents.simulation.roll_out(situation.diagnosis, chosen.probe.actions)
        except TimeoutError:
            return None  # the proposers are late as well, and say so
        return await self._do(chosen, alone, situation)

    async def _admitted(self, probing: Probing, situation: Situation, probes: Sequence[Probe]) -> _Admitted | None:
        """The first of ``probes`` that some fallback ends safely under every plausible explanation."""
        after_s = self._bounds.probe_s + self._bounds.answer_s + WRITING_S
        for probe in probes:
            for retreat in self._rules.fallbacks:
                ended = Interruption(after_s, retreat.actions)
                rollout = await probing.try_out(probe, situation.diagnosis, ended)
                verdict = judge_passing(probe.actions, rollout, self._rules.limits, self._rules.tags, probe.path)
                if isinstance(verdict, Approve):
                    if probe.path is not None:
                        attempt = Attempt(1, probe.path, probe.actions, verdict, len(rollout.weights))
                        self._scene.record(Attempted.of(PROPOSER, attempt))
                    return _Admitted(probe, retreat, ended, verdict)
        return None

    async def _do(self, chosen: _Admitted, alone: Rollout, situation: Situation) -> Resolution | None:
        """Begin it; ``alone`` is what it does if nothing ends it."""
        probe, scene = chosen.probe, self._scene
        outcome: Released | NoActionNeeded
        self._begun.append((probe.actions.digest, probe.apart))
        state, commands = ("", ()) if probe.path is None else (probe.actions.target, probe.actions.commands)
        worth = (probe.nats, probe.value, probe.cost)
        scene.record(Probed(probe.apart, state, commands, self._bounds.probe_s, *worth))
        if probe.path is None:
            await scene.look()
            outcome = NoActionNeeded(scene.seen_s, chosen.verdict.min_margin)
        else:
            cost = self._pricing.of(alone, probe.actions.states, releases=1)
            found = Approved(probe.actions, probe.path, chosen.verdict, PROPOSER, cost, ended=chosen.ended)
            try:
                outcome = (await self._releasing.release(found, situation.diagnosis)).outcome
            except (Refused, Overtaken, Withdrawn, TimeoutError) as failed:
                scene.record(GaveUp(PROPOSER, str(failed)))
                return None
            self._progress.expect(probe.actions.then, alone, outcome.at_s)
        until_s = outcome.at_s + self._bounds.probe_s
        self._under_way = _UnderWay(probe, until_s)
        if not isinstance(judge_safety(probe.actions, alone, self._rules.limits), Approve):
            scene.send(Arm((chosen.retreat.name,), until_s + self._bounds.answer_s))
        return outcome
