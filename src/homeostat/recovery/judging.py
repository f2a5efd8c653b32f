"""Judging: proposals, holds, waits and tests tried on the twin, judged by all that forbids, and priced."""

import math
from dataclasses import dataclass, replace

from homeostat.agents.checks import Part, judge_parts, judge_safety
from homeostat.agents.no_worse import comparable, judge_no_worse
from homeostat.agents.postponed import judge_postponed
from homeostat.agents.pricing import Pricing
from homeostat.agents.reliance import Relying
from homeostat.agents.roles import Agents, Approved, Probe, Situation
from homeostat.agents.search.candidates import design_commands
from homeostat.domain.advice import Attempt
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.cost import KNOWING, Cost, CostItem
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet, RecoveryPath, action_digest
from homeostat.domain.verdict import Approve, Finding, Revise, Rollout, Verdict
from homeostat.guard.requests.permissives import refusal
from homeostat.recovery.choices import Choice, Testing, Waiting
from homeostat.recovery.deadline import first_violated_s
from homeostat.recovery.orders import taken_back
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.probing import Probes
from homeostat.recovery.scene import Scene
from homeostat.recovery.waits import Waits
from homeostat.twin.twin import Interruption

WAIT = "CHK-WAIT"
"""Name of the refusal of a wait or hold that there is no time for, or that cannot be judged."""
TEST = "CHK-TEST"
"""Name of the refusal of a test move that the prober itself would not begin."""
KINDS = AlternativeKind


def unholdable(path: RecoveryPath) -> Revise | None:
    """Why ``path`` cannot be held for a while, whatever its commands; None where it can."""
    if not path.awaited:
        return None
    text = "a route with later steps cannot be held for a while; propose it for good"
    return Revise((refusal(WAIT, text, Owner.PLANNING),))


@dataclass(frozen=True, slots=True)
class Judged:
    """One attempt, and what may be chosen because of it; None where it is refused."""

    attempt: Attempt
    found: Choice | None


@dataclass(frozen=True, slots=True)
class Follow:
    """What is expected to follow a wait or a test."""

    name: str
    """The path of a proposal, or the name of a fallback."""
    part: Part
    """What is commanded then."""
    target: State | None
    """State that is to be reached in the end; None where safety is all that counts."""

    @classmethod
    def of(cls, actions: ActionSet, path: RecoveryPath) -> "Follow":
        """A proposal."""
        return cls(" > ".join(path.states), Part(actions, path), path.machine.state(path.target))


class Judging:
    """Judges for one recovery after the other; what it approves may stand in the list."""

    def __init__(self, scene: Scene, agents: Agents, rules: PlantRules, bounds: Bounds, probes: Probes, waits: Waits):
        """``probes`` know which tests are safe, ``waits`` how often it may still be waited."""
        self._scene, self._agents, self._rules, self._bounds = scene, agents, rules, bounds.intervention
        self._pricing = Pricing(rules.prices, rules.limits, rules.scales)
        self._probes, self._waits = probes, waits

    def is_open(self, path: RecoveryPath, situation: Situation) -> bool:
        """Whether the machine lets the plant take ``path`` now, which no proposer is trusted with."""
        machine, values = self._rules.machine, situation.snapshot.values
        return (
            path.machine == machine
            and path.states[0] == situation.state
            and machine.state(path.target).recovery_target
            and all(t.guard.holds(values) for t in path.decisions)
        )

    async def proposal(
        self, by: str, number: int, situation: Situation, path: RecoveryPath, actions: ActionSet
    ) -> Judged:
        """``actions`` that are to last."""
        rollout = await self._agents.simulation.roll_out(situation.diagnosis, actions)
        verdict = self._agents.validation.judge(actions, rollout, path.machine.state(path.target), path)
        if situation.optional and not situation.diagnosis.faulty:
            state, rules = self._rules.machine.state(situation.state), self._rules
            back = taken_back(state, situation.snapshot.values, rules.tags, actions)
            verdict = Revise((*verdict.findings, *back)) if back else verdict
        cost = self._pricing.of(rollout, actions.states, releases=1) if rollout.weights else None
        attempt = Attempt(number, path, actions, verdict, len(rollout.weights), cost, hypotheses=rollout.hypotheses)
        if not isinstance(verdict, Approve) or cost is None:
            return Judged(attempt, None)
        return await self._approved(situation, attempt, rollout, Approved(actions, path, verdict, by, cost))

    async def _approved(self, situation: Situation, attempt: Attempt, rollout: Rollout, found: Approved) -> Judged:
        """What was ``found``, unless it counts on actuators that nobody has seen move: more than leaving alone does."""
        instead = self._instead(situation)
        asked = Relying(found.actions, found.path.commanded_states, instead, found.ended)
        findings = await self._agents.simulation.relied_on(situation.diagnosis, asked, rollout)
        if findings:
            return Judged(replace(attempt, verdict=Revise((*found.approval.findings, *findings))), None)
        return Judged(attempt, replace(found, instead=instead))

    def _instead(self, situation: Situation) -> tuple[ActionSet, ...]:
        """What happens where nothing is released."""
        fallback = () if situation.fallback is None else (situation.fallback.actions,)
        return (self._scene.now.rest, *fallback)

    async def no_worse(self, by: str, situation: Situation, attempt: Attempt) -> Judged:
        """A refused proposal that is to last, by what the fallback does at once in the same members.

        Members in which a limit is violated whatever is done are no reason to fall back.
        """
        fallback, actions, path = situation.fallback, attempt.actions, attempt.path
        if fallback is None or actions is None or path is None or attempt.kind is not KINDS.RELEASE:
            return Judged(attempt, None)
        if not comparable(attempt.verdict, self._rules.limits):
            return Judged(attempt, None)
        judged = await self.proposal(by, attempt.number, situation, path, actions)
        if judged.found is not None or judged.attempt.cost is None:
            return judged
        rollout = await self._agents.simulation.roll_out(situation.diagnosis, actions)
        at_once = await self._agents.simulation.roll_out(situation.diagnosis, fallback.actions)
        rules = self._rules
        verdict = judge_no_worse(
            judged.attempt.verdict, rollout, at_once, rules.limits, rules.scales, rules.timing.tick_s
        )
        if not isinstance(verdict, Approve):
            return judged
        found = Approved(actions, path, verdict, by, judged.attempt.cost, beside=fallback.actions)
        return await self._approved(situation, replace(judged.attempt, verdict=verdict), rollout, found)

    async def hold(
        self, by: str, number: int, situation: Situation, path: RecoveryPath, actions: ActionSet, seconds: float
    ) -> Judged:
        """``actions`` for so many ``seconds``, and then the design of the state that the plant is in now."""
        state = self._rules.machine.state(situation.state)
        back = self._way_back(state, situation, actions)
        then, ended = Follow(state.name, Part(back), state), Interruption(seconds, back)
        alone = await self._agents.simulation.roll_out(situation.diagnosis, actions)
        rollout, verdict = await self._rolled(situation, Part(actions, path), ended, then)
        near_s = first_violated_s(alone, self._rules.limits)
        if isinstance(verdict, Approve) and near_s <= seconds + self._bounds.answer_s:
            text = f"held for {seconds:g} s it must not go on for {near_s:.0f} s; hold it for less"
            verdict = Revise((_late(text, near_s - seconds),))
        cost = self._priced(rollout, actions.states, seconds, back.states, releases=2)
        attempt = Attempt(number, path, actions, verdict, len(rollout.weights), cost, kind=KINDS.HOLD, seconds=seconds)
        if not isinstance(verdict, Approve) or cost is None:
            return Judged(attempt, None)
        found = Approved(actions, path, verdict, by, cost, ended=ended, for_s=seconds)
        return await self._approved(situation, attempt, rollout, found)

    def _way_back(self, state: State, situation: Situation, held: ActionSet) -> ActionSet:
        """The design of the ``state`` that the plant came from; what that leaves open is put back to what it was."""
        by_design = design_commands(state, self._rules.tags)
        named, values = {c.tag for c in by_design}, situation.snapshot.values
        others = [c for c in held.commands if c.tag not in named]
        put_back = tuple(
            replace(c, value=value if math.isfinite(value := values.get(c.tag, math.nan)) else None) for c in others
        )
        return ActionSet((*by_design, *put_back), state.name)

    async def wait(
        self, by: str, number: int, situation: Situation, seconds: float, follow: Follow | None,
        nuisance: tuple[str, ...] = (),
    ) -> Judged:  # fmt: skip
        """Nothing for so many ``seconds``, and then what is to ``follow``; the fallback where that is None."""
        rest, then = self._scene.now.rest, follow or _fallback(situation)
        why = await self._no_time(situation, seconds)
        if why is None and then is None:
            why = refusal(WAIT, "nothing is known to follow a wait; propose a path", Owner.PLANNING)
        if why is not None or then is None:
            findings = () if why is None else (why,)
            return Judged(Attempt(number, None, rest, Revise(findings), kind=KINDS.WAIT, seconds=seconds), None)
        ended = Interruption(seconds, then.part.actions)
        rollout, verdict = await self._rolled(situation, Part(rest, needs=False), ended, then)
        states = (situation.state, *rest.states)
        cost = self._priced(rollout, states, seconds, then.part.actions.states, releases=1)
        attempt = Attempt(number, None, rest, verdict, len(rollout.weights), cost, kind=KINDS.WAIT, seconds=seconds)
        if not isinstance(verdict, Approve) or cost is None:
            return Judged(attempt, None)
        digest = action_digest("wait", [seconds], [rest.digest, then.part.actions.digest])
        return Judged(attempt, Waiting(seconds, then.name, digest, verdict, by, cost, ended, None, nuisance))

    async def postponement(
        self, by: str, number: int, situation: Situation, seconds: float, answer_s: float = math.inf
    ) -> Judged:
        """Nothing for so many ``seconds``, and then the fallback, where that is no worse than falling back now.

        Members in which even the fallback keeps no hard limit are no reason to fall back at once: what counts is
        whether any limit is violated by more, or for longer, for the wait. Where less than usual is kept for thinking
        after it, ``answer_s`` [s], the fallback is tried as late as the guard takes it by itself.
        """
        rest, then = self._scene.now.rest, _fallback(situation)
        if then is None or await self._no_time(situation, seconds, answer_s) is not None:
            return Judged(Attempt(number, None, rest, Revise(()), kind=KINDS.WAIT, seconds=seconds), None)
        fallback = then.part.actions
        at_once = await self._agents.simulation.roll_out(situation.diagnosis, fallback)
        latest_s = seconds
        if answer_s < self._bounds.answer_s:
            latest_s = min(seconds + self._bounds.answer_s, self._left_s(situation))
        ended = Interruption(latest_s, fallback)
        later = await self._agents.simulation.roll_out(situation.diagnosis, rest, ended)
        verdict = judge_postponed(rest, later, fallback, at_once, self._rules.limits, self._rules.timing.tick_s)
        cost = self._priced(later, (situation.state, *rest.states), seconds, fallback.states, releases=1)
        attempt = Attempt(number, None, rest, verdict, len(later.weights), cost, kind=KINDS.WAIT, seconds=seconds)
        if not isinstance(verdict, Approve) or cost is None:
            return Judged(attempt, None)
        digest = action_digest("wait", [seconds], [rest.digest, fallback.digest])
        keeps = isinstance(judge_safety(fallback, at_once, self._rules.limits), Approve)
        found = Waiting(seconds, then.name, digest, verdict, by, cost, ended, None if keeps else fallback)
        return Judged(attempt, found)

    async def test(self, by: str, number: int, situation: Situation, probe: Probe, follow: Follow | None) -> Judged:
        """A test move, as the prober judges it; what knowing more is worth is taken off what it costs."""
        seconds, then = self._bounds.probe_s, follow or _fallback(situation)
        known = Attempt(number, probe.path, probe.actions, Revise(()), kind=KINDS.TEST, seconds=seconds)
        admitted = await self._probes.admitted(situation, probe) if then is not None else None
        if admitted is None or then is None or situation.state != _start(probe):
            text = "the test is not safe until a fallback has ended it, or there is no time for it; name another one"
            return Judged(_with(known, Revise((refusal(TEST, text, Owner.PLANNING),))), None)
        ended = Interruption(seconds, then.part.actions)
        rollout = await self._agents.simulation.roll_out(situation.diagnosis, probe.actions, ended)
        cost = self._priced(rollout, probe.actions.states, seconds, then.part.actions.states, releases=2)
        if cost is None:
            return Judged(_with(known, Revise((refusal("CHK-ROLLOUT", rollout.note),))), None)
        cost = Cost((*cost.items, CostItem(KNOWING, -probe.value * cost.worth)), cost.worth)
        return Judged(_with(known, admitted.verdict, cost, len(rollout.weights)), Testing(admitted, by, cost, seconds))

    async def _rolled(
        self, situation: Situation, first: Part, ended: Interruption, then: Follow
    ) -> tuple[Rollout, Verdict]:
        rollout = await self._agents.simulation.roll_out(situation.diagnosis, first.actions, ended)
        length = rollout.trajectory.length * rollout.trajectory.dt_s if rollout.weights else math.inf
        if ended.after_s >= length:
            text = f"{ended.after_s:g} s are longer than the twin looks ahead, {length:g} s; name a shorter time"
            return rollout, Revise((refusal(WAIT, text, Owner.PLANNING),))
        rules = self._rules
        return rollout, judge_parts(first, then.part, rollout, ended.after_s, rules.limits, rules.tags, then.target)

    def _priced(
        self, rollout: Rollout, states: tuple[str, ...], seconds: float, then: tuple[str, ...], releases: int
    ) -> Cost | None:
        if not rollout.weights:
            return None
        whole_s = rollout.trajectory.length * rollout.trajectory.dt_s
        parts = ((states, min(seconds, whole_s)), (then, max(whole_s - seconds, 0.0)))
        return self._pricing.of_parts(rollout, parts, releases)

    def _left_s(self, situation: Situation) -> float:
        """Time until the guard falls back by itself; infinite where it does not [s]."""
        return (math.inf if situation.act_by_s is None else situation.act_by_s) - self._scene.seen_s

    async def _no_time(self, situation: Situation, seconds: float, answer_s: float = math.inf) -> Finding | None:
        """Why it may not be waited so long, whatever follows; None where it may.

        ``answer_s``: the time that is kept for thinking after it, where that is less than usual [s].
        """
        scene = self._scene
        if not self._waits.left:
            text = "it was waited as often as it may be until nothing is wrong; propose a path"
            return refusal(WAIT, text, Owner.PLANNING)
        left_s = self._left_s(situation) - min(self._bounds.answer_s, answer_s)
        if left_s <= seconds:
            text = f"{seconds:g} s to wait; a fallback must act in {left_s:.0f} s with what thinking takes: name less"
            return _late(text, left_s - seconds)
        if scene.now.rest.then:
            rollout = await self._agents.simulation.roll_out(situation.diagnosis, scene.now.rest)
            first_s = min((band.earliest_s for band in rollout.bands[:1]), default=-math.inf) - scene.seen_s
            if first_s <= seconds:
                text = f"{seconds:g} s to wait; the next step of the batch may be due before: name less, or a path"
                return _late(text, first_s - seconds)
        return None


def _fallback(situation: Situation) -> Follow | None:
    """What acts where nothing else may be done."""
    strategy = situation.fallback
    return None if strategy is None else Follow(strategy.name, Part(strategy.actions, needs=False), None)


def _late(text: str, margin_s: float) -> Finding:
    return Finding(WAIT, Owner.PLANNING, min(margin_s, -1.0), "s", 0.0, 0, text)


def _start(probe: Probe) -> str:
    """State in which a test begins."""
    return "" if probe.path is None else probe.path.states[0]


def _with(attempt: Attempt, verdict: Verdict, cost: Cost | None = None, members: int = 0) -> Attempt:
    told = attempt.path, attempt.actions, verdict, members, cost
    return Attempt(attempt.number, *told, kind=attempt.kind, seconds=attempt.seconds)
