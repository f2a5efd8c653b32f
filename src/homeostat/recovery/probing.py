"""Probing: a test move or a wait before anything is done for good, where that is worth it, safe, and time is left."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, replace

from homeostat.agents.checks import judge_passing, judge_safety
from homeostat.agents.hypotheses import counted
from homeostat.agents.pricing import Pricing
from homeostat.agents.probing.twin_probing import CERTAIN
from homeostat.agents.reliance import Relying
from homeostat.agents.roles import Agents, Approved, Probe, Probing, Situation
from homeostat.agents.search.candidates import along_by_design
from homeostat.domain.advice import Attempt
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.cost import KNOWING, Cost, CostItem
from homeostat.domain.diagnosis import Diagnosis, by_fault_set
from homeostat.domain.events.recovery import Attempted, GaveUp, Probed, ProbeEnded
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Arm
from homeostat.domain.recovery import action_digest
from homeostat.domain.verdict import Approve, NoActionNeeded, Released, Resolution, Rollout
from homeostat.recovery.alternatives import Alternatives, digest_of
from homeostat.recovery.certifying import Certifying
from homeostat.recovery.choices import Admitted, Testing, Waiting
from homeostat.recovery.deadline import first_violated_s
from homeostat.recovery.going_on import comes_to_its_end, way_on
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.progress import ProgressMonitor
from homeostat.recovery.release_check import Check
from homeostat.recovery.releasing import Overtaken, Refused, Releasing, Taken, Withdrawn
from homeostat.recovery.scene import Scene
from homeostat.recovery.waits import Ended
from homeostat.twin.twin import Interruption

PROPOSER = "search"
"""Who proposes probes."""
TRIED = 3
"""Most probes that are validated in one look, and most that are offered to proposers."""
LEAST = 0.02
"""Production that a probe is expected to win at least, beyond what it costs, where nobody else proposes it [1]."""
WRITING = 2.0
"""Ticks that it may take until a test move is written and read back."""


@dataclass(frozen=True, slots=True)
class _UnderWay:
    """A probe that has begun."""

    probe: Probe
    until_s: float
    """Process time at which the plant is looked at again [s]."""
    back: bool = False
    """Whether it is the way back from a test, which tells nothing."""
    late: bool = False
    """Whether it was looked at in vain: the diagnosis that is late says when that is done again."""


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
        self._releasing = Releasing(scene, check, bounds.budget, rules.limits)
        self._pricing = Pricing(rules.prices, rules.limits, rules.scales)
        self._certifying = Certifying(scene, agents.simulation, bounds.risk)
        self._under_way: _UnderWay | None = None
        self._stop: Probe | None = None
        self._begun: list[tuple[str, tuple[str, str]]] = []
        self.offered: tuple[Probe, ...] = ()
        """Test moves that proposers may name since the last look: they pay, and were not begun yet."""

    def due(self, now_s: float) -> bool:
        """Whether a probe is over and was not looked at."""
        under_way = self._under_way
        return under_way is not None and not under_way.late and now_s >= under_way.until_s

    def look_in_vain(self) -> None:
        """The diagnosis is late: what is under way is ended by it, as the plant stands where a test has brought it."""
        if self._under_way is not None:
            self._under_way = replace(self._under_way, late=True)

    def drop(self) -> None:
        """A fallback acts: nobody learns anything from the probe any more."""
        self._under_way = self._stop = None

    def end(self, diagnosis: Diagnosis) -> Ended:
        """Say what came of the probe that is under way, if any, and whether it was a wait or has moved the plant."""
        if not diagnosis.faulty:
            self._begun = []
        stopped = None if self._stop is None else self._stop.path
        if stopped is not None and self._scene.now.state not in stopped.commanded:
            self._stop = None  # it goes on; whatever stops it later was not this test
        if self._under_way is None:
            return Ended()
        ended, self._under_way = self._under_way, None
        if ended.back:
            return Ended(waited=True, whole=self._scene.seen_s >= ended.until_s)
        probe, until_s = ended.probe, ended.until_s
        best = by_fault_set(counted(diagnosis))[:1]
        name, probability = (best[0].name, best[0].probability) if best else ("none", 1.0)
        self._scene.record(ProbeEnded(probe.apart, name, probability, probability >= CERTAIN))
        moved = probe.path is not None
        return Ended(waited=True, held=moved, whole=self._scene.seen_s >= until_s)

    async def begin(
        self, situation: Situation, idle: Rollout, alternatives: Alternatives, began: float
    ) -> Resolution | None:
        """What was begun; None where nothing is worth it, safe and in time, or it was refused.

        ``idle`` is what happens without action; what is begun joins the ``alternatives``, and all of it is told. What
        is thought counts from ``began``, by the event loop's clock [s]; a release that was begun is ended.
        """
        probing, scene, bounds = self._agents.probing, self._scene, self._bounds
        needed_s, self.offered = bounds.probe_s + bounds.answer_s + self._budget.reserve_s, ()
        near = first_violated_s(idle, self._rules.limits) <= needed_s
        near = near or situation.deadline_s < bounds.probe_s  # an armed fallback would act in the middle of it
        if probing is None or near or len(self._begun) >= bounds.probes or scene.now.mode is not Mode.CLOSED_LOOP:
            return None
        end = scene.end(began, situation.deadline_s)
        try:
            async with asyncio.timeout_at(scene.cut(end)):
                found = await probing.probes(situation, scene.now.rest, bounds.probe_s)
                fresh = [p for p in found if (p.actions.digest, p.apart) not in self._begun]
                self.offered = tuple(p for p in fresh if p.path is not None)[:TRIED]
                worth = [p for p in fresh if p.value - p.cost >= LEAST]
                chosen = await self._first_admitted(probing, situation, worth[:TRIED])
        except TimeoutError:
            return None  # the proposers are late as well, and say so
        if chosen is None:
            return None
        alone = await self._agents.simulation.roll_out(situation.diagnosis, chosen.probe.actions)
        listed = self._listed(chosen, alone, situation)
        self._scene.record(Attempted.of(PROPOSER, _attempt(listed, chosen, len(alone.weights))))
        alternatives.add(listed)
        await self._certifying.add_to(alternatives, situation.diagnosis, end)
        self._scene.record(alternatives.event(digest_of(listed)))
        try:
            return (await self._take(chosen, alone, situation, PROPOSER)).outcome
        except (Refused, Overtaken, Withdrawn, TimeoutError):
            return None

    def _listed(self, chosen: Admitted, alone: Rollout, situation: Situation) -> Testing | Waiting:
        """What was ``chosen`` as one of the list, at the cost of what it does ``alone``, less what knowing is worth.

        What follows it is not known yet: it is priced as if it went on, with a release to begin it and one to end it.
        """
        probe, seconds = chosen.probe, self._bounds.probe_s
        releases = 0 if probe.path is None else 2
        cost = self._pricing.of_parts(alone, ((probe.actions.states, seconds),), releases)
        cost = Cost((*cost.items, CostItem(KNOWING, -probe.value * cost.worth)), cost.worth)
        if probe.path is not None:
            return Testing(chosen, PROPOSER, cost, seconds)
        digest = action_digest("wait", [seconds], [probe.actions.digest])
        return Waiting(seconds, situation.state, digest, chosen.verdict, PROPOSER, cost, chosen.ended)

    async def go_back(self, situation: Situation) -> Resolution | None:
        """Let what a test move has stopped go on where it was, as nobody has anything better; None where it may not.

        It is judged as the test was. What is known by now may say that it comes to no end from there, and that was no
        reason to stop it for good.
        """
        probing, stop = self._agents.probing, self._stop
        if probing is None or stop is None or stop.path is None or situation.state != stop.path.target:
            return None
        way = way_on(stop.path, situation.snapshot)
        if way is None:
            return None
        back = replace(stop, path=way, actions=along_by_design(way, self._rules.tags), value=0.0, cost=0.0)
        try:
            chosen = await self._first_admitted(probing, situation, (back,))
            return None if chosen is None else (await self.take(chosen, situation, PROPOSER, back=True)).outcome
        except (Refused, Overtaken, Withdrawn, TimeoutError):
            return None

    async def admitted(self, situation: Situation, probe: Probe) -> Admitted | None:
        """``probe`` with the fallback that ends it safely; None where it is not on offer, or none does."""
        probing = self._agents.probing
        if probing is None or probe not in self.offered:
            return None
        return await self._first_admitted(probing, situation, (probe,))

    async def _first_admitted(self, probing: Probing, situation: Situation, probes: Sequence[Probe]) -> Admitted | None:
        """The first of ``probes`` that some fallback ends safely under every plausible explanation."""
        after_s = self._bounds.probe_s + self._bounds.answer_s + WRITING * self._rules.timing.tick_s
        for probe in probes:
            if not await self._can_go_on(situation, probe, after_s):
                continue
            for retreat in self._rules.fallbacks:
                ended = Interruption(after_s, retreat.actions)
                rollout = await probing.try_out(probe, situation.diagnosis, ended)
                verdict = judge_passing(probe.actions, rollout, self._rules.limits, self._rules.tags, probe.path)
                if isinstance(verdict, Approve) and not await self._relied_on(situation, probe, ended, rollout):
                    return Admitted(probe, retreat, ended, verdict)
        return None

    async def _can_go_on(self, situation: Situation, probe: Probe, after_s: float) -> bool:
        """Whether a batch that ``probe`` stops comes to its end where it may go on ``after_s`` [s] later."""
        way = way_on(probe.path, situation.snapshot)
        if way is None:
            return True
        ended = Interruption(after_s, along_by_design(way, self._rules.tags))
        rollout = await self._agents.simulation.roll_out(situation.diagnosis, probe.actions, ended)
        return comes_to_its_end(rollout, self._rules.limits)

    async def _relied_on(self, situation: Situation, probe: Probe, ended: Interruption, rollout: Rollout) -> bool:
        """Whether a test move counts on actuators that nobody has seen move."""
        if probe.path is None:
            return False
        asked = Relying(probe.actions, probe.path.commanded_states, (self._scene.now.rest, ended.actions), ended)
        return bool(await self._agents.simulation.relied_on(situation.diagnosis, asked, rollout))

    async def take(self, chosen: Admitted, situation: Situation, proposer: str, back: bool = False) -> Taken:
        """Begin what ``proposer`` proposed; what does not begin is offered no more. ``back``: it ends another one.

        Raises as :meth:`Releasing.release` does.
        """
        alone = await self._agents.simulation.roll_out(situation.diagnosis, chosen.probe.actions)
        return await self._take(chosen, alone, situation, proposer, back)

    async def _take(
        self, chosen: Admitted, alone: Rollout, situation: Situation, proposer: str, back: bool = False
    ) -> Taken:
        probe, scene = chosen.probe, self._scene
        outcome: Released | NoActionNeeded
        if not back:
            self._begun.append((probe.actions.digest, probe.apart))
        self.offered = tuple(other for other in self.offered if other != probe)
        state, commands = ("", ()) if probe.path is None else (probe.actions.target, probe.actions.commands)
        worth = (probe.nats, probe.value, probe.cost)
        if not back:
            scene.record(Probed(probe.apart, state, commands, self._bounds.probe_s, *worth, proposer))
        if probe.path is None:
            await scene.look()
            outcome = NoActionNeeded(scene.seen_s, chosen.verdict.min_margin)
        else:
            cost = self._pricing.of(alone, probe.actions.states, releases=1)
            found = Approved(
                probe.actions, probe.path, chosen.verdict, proposer, cost,
                ended=chosen.ended, instead=(scene.now.rest, chosen.ended.actions),
            )  # fmt: skip
            try:
                outcome = (await self._releasing.release(found, situation.diagnosis)).outcome
            except (Refused, Overtaken, Withdrawn, TimeoutError) as failed:
                scene.record(GaveUp(proposer, str(failed)))
                raise
            self._progress.expect(probe.actions.then, alone, outcome.at_s)
        if probe.path is not None:
            self._stop = probe if way_on(probe.path, situation.snapshot) is not None else None
        until_s = outcome.at_s + self._bounds.probe_s
        self._under_way = _UnderWay(probe, until_s, back)
        if not isinstance(judge_safety(probe.actions, alone, self._rules.limits), Approve):
            scene.send(Arm((chosen.retreat.name,), until_s + self._bounds.answer_s))
        return Taken(outcome, alone)


def _attempt(listed: Testing | Waiting, chosen: Admitted, members: int) -> Attempt:
    """What was chosen, as an attempt that is approved."""
    probe, told = chosen.probe, (chosen.verdict, members, listed.cost)
    if isinstance(listed, Waiting):
        return Attempt(1, None, probe.actions, *told, kind=AlternativeKind.WAIT, seconds=listed.seconds)
    return Attempt(1, probe.path, probe.actions, *told, kind=AlternativeKind.TEST, seconds=listed.seconds)
