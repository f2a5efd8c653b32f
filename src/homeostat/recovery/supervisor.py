"""The framework's figure as three methods: supervise, recover, deliberate."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import assert_never

from homeostat.agents.bounds import Budget, Patience
from homeostat.agents.checks import closed_finding, repetition_finding
from homeostat.agents.crew import Approved, Crew, NoAdmissiblePlan, Proposer, Situation
from homeostat.agents.planning import EVENT
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.behaviour import StateMachine
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.guard_events import FellBack, StateEntered
from homeostat.domain.limits import Limits
from homeostat.domain.ports import Clock, Plant
from homeostat.domain.production import Production
from homeostat.domain.recovery import FallbackStrategy, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import (
    Approve,
    Departure,
    HandedOver,
    LeftAlone,
    Outcome,
    Released,
    Revise,
    Rollout,
    Verdict,
)
from homeostat.guard.gate import Gate, Overtaken, Refused
from homeostat.guard.sequencer import Sequencer
from homeostat.recovery.arming import ValidatedFallback, choose
from homeostat.recovery.deadline import SHORTEST_S, deadline_s
from homeostat.recovery.intervention import InterventionPolicy
from homeostat.recovery.progress import ProgressMonitor
from homeostat.recovery.release_check import TwinReleaseCheck
from homeostat.trace.decisions import (
    Attempted,
    Departed,
    Diagnosed,
    FallbackArmed,
    GaveUp,
    LeftAsIs,
    Noticed,
    ReleasedActions,
)
from homeostat.trace.events import Trace

RECENT = 300
"""Snapshots that proposers may look back on."""
FIRST_LOOK = 5
"""Snapshots that the twin needs before it predicts the nominal route."""


class Supervisor:
    """Watches the plant; every fault that monitoring reports gets one bounded recovery."""

    def __init__(
        self,
        plant: Plant,
        clock: Clock,
        crew: Crew,
        gate: Gate,
        rehearsal: TwinReleaseCheck,
        sequencer: Sequencer,
        machine: StateMachine,
        limits: Limits,
        production: Production,
        fallbacks: Sequence[FallbackStrategy],
        scales: Mapping[str, float],
        patience: Patience,
        budget: Budget,
        trace: Trace,
        every_step: bool = False,
    ) -> None:
        """Wire the parts together; nothing happens before :meth:`supervise`.

        ``scales``: unit -> what counts as one unit of margin in it. With ``every_step`` the proposers are asked in
        every state that the plant enters, also where nothing is wrong.
        """
        self._plant, self._clock, self._crew, self._gate = plant, clock, crew, gate
        self._rehearsal, self._sequencer, self._machine, self._limits = rehearsal, sequencer, machine, limits
        self._restraint = InterventionPolicy(limits, production, scales)
        self._fallbacks, self._patience, self._budget, self._trace = tuple(fallbacks), patience, budget, trace
        self._expectation = ProgressMonitor(patience.slack_s, patience.repeat_s)
        self._accepted: frozenset[str] = frozenset()
        self._every_step, self._asked = every_step, ("", -math.inf)
        self._released_s = math.inf
        self._seen_s = 0.0
        self._recent: deque[Snapshot] = deque(maxlen=RECENT)

    async def supervise(self) -> None:
        """Watch the plant until it is shut off; act on what monitoring reports and on broken hard limits."""
        try:
            async for snapshot in self._plant.snapshots():
                await self._take(snapshot)
        except BaseException as error:  # a bug or a shutdown: make the plant safe, then let it be seen
            await self._hand_over(f"internal error ({type(error).__name__})", unattended=True)
            raise

    async def _take(self, snapshot: Snapshot) -> None:
        """One snapshot: hard limits first, then monitoring, then whether the batch goes as predicted."""
        self._remember((snapshot,))
        self._note_states()
        broken = self._gate.watch(snapshot)
        noticed = self._crew.monitoring.notices(snapshot)
        if self._gate.latched is not None:
            return
        if broken is not None and self._sequencer.state != self._machine.initial.name:
            self._crew.monitoring.follow(await self._hand_over(broken))
            return
        await self._predict()
        departure = self._expectation.departs(self._sequencer, snapshot.at_s)
        if (noticed and not self._judged) or departure is not None or self._step_is_due:
            await self._attend(departure)

    async def _attend(self, departure: Departure | None = None) -> None:
        """Find out what is wrong, and recover if anything is; the plant runs on meanwhile.

        Where the batch departs from its prediction, it is judged again although no fault explains why.
        """
        self._clock.start()
        try:
            self._trace.record(Noticed(tuple(s.rule for s in self._crew.monitoring.symptoms)), self._seen_s)
            if departure is not None:
                self._trace.record(Departed.of(departure, self._sequencer.state), self._seen_s)
            diagnosis = await asyncio.to_thread(self._crew.monitoring.diagnose, departure is not None)
            if diagnosis.faulty:
                self._trace.record(Diagnosed.of(diagnosis), diagnosis.at_s)
            if diagnosis.faulty or departure is not None or self._step_is_due:
                outcome = await self.recover(diagnosis)
                released = departure is not None and isinstance(outcome, Released)
                if diagnosis.faulty or released or isinstance(outcome, HandedOver):
                    self._crew.monitoring.follow(outcome)
        finally:
            self._clock.stop()
            for retrieved in self._crew.grounding.drain():
                self._trace.record(retrieved, self._seen_s)

    async def recover(self, diagnosis: Diagnosis) -> Outcome:
        """Release a validated action set within the time that physics leaves, leave the plant alone, or hand over."""
        began = asyncio.get_running_loop().time()
        idle = await self._look(diagnosis)
        self._gate.correct(self._crew.simulation.instrument_errors(diagnosis))
        fallback = await self._arm_fallback(diagnosis)
        limit_s = deadline_s(idle, self._limits, self._budget.latency_s, self._budget.reserve_s)
        self._trace.record(_armed(fallback, limit_s), self._seen_s)
        verdict = self._judge_idle(idle)
        fine = self._restraint.fine(verdict, self._recovered)
        if due := self._step_is_due:
            self._asked = self._sequencer.state, self._seen_s
        calm = not diagnosis.faulty or self._seen_s - self._released_s < self._patience.calm_s
        if fine and calm and not due:
            return self._leave_alone(verdict)
        if self._finished:  # nobody can propose anything: what matters is that nothing breaks
            if not (fine or self._restraint.harmless(verdict)):
                return await self._hand_over("the batch is over, and what follows breaks a limit")
            self._accepted = self._rules
            return self._leave_alone(verdict)
        recent = tuple(self._recent)
        situation = Situation(
            recent[-1], diagnosis, self._sequencer.state, recent, verdict.findings, limit_s, self._sequencer.way(),
            self._sequencer.rest().commands,
        )  # fmt: skip
        try:
            return await self._ask_proposers(situation, idle if fine and not due else None, began)
        except (TimeoutError, NoAdmissiblePlan, Refused) as reason:
            if fine or (self._recovered and self._restraint.harmless(verdict)):
                return self._leave_alone(verdict)
            text = str(reason) or f"no approved proposal within {limit_s:.1f} s"
            return await self._hand_over(text, thought=True)

    async def deliberate(self, proposer: Proposer, situation: Situation, idle: Rollout | None = None) -> Approved:
        """Plan, act, simulate, validate and reprompt until a verdict approves.

        Where the plant may also be left as it is (``idle`` is that rollout), only what produces clearly more will do.
        """
        advice = Advice()
        most = proposer.attempts if idle is None else self._patience.improvements
        for number in range(1, most + 1):
            situation = await self._fresh(situation)
            attempt, rollout = await self._attempt(number, proposer, situation, advice)
            self._trace.record(Attempted.of(proposer.name, attempt), self._seen_s)
            match attempt.verdict:
                case Approve() as approval:
                    # Nothing else is approved.
                    assert attempt.path is not None and attempt.actions is not None and rollout is not None
                    if idle is None or self._restraint.gains(idle, rollout, self._risk_added(attempt.path)):
                        return Approved(attempt.actions, attempt.path, approval, proposer.name)
                    refused = (*advice.refused_paths, attempt.path.commanded)
                    advice = Advice(refused_paths=refused, attempts=(*advice.attempts, attempt))
                case Revise():
                    after = await proposer.reprompting.advise(situation, attempt, advice)
                    advice = replace(after, attempts=(*advice.attempts, attempt))
                case _:
                    assert_never(attempt.verdict)
        if idle is not None:
            raise NoAdmissiblePlan(f"{proposer.name}: nothing clearly better than leaving the plant alone")
        raise NoAdmissiblePlan(f"{proposer.name}: no proposal was approved in {most} attempts")

    def _risk_added(self, path: RecoveryPath) -> int:
        """By how many ranks ``path`` is riskier than what follows if nobody interferes."""
        left = (self._sequencer.state, *self._sequencer.rest().states)
        most = [max(self._machine.state(name).risk for name in states) for states in (path.commanded, left)]
        return max(most[0] - most[1], 0)

    async def _attempt(
        self, number: int, proposer: Proposer, situation: Situation, advice: Advice
    ) -> tuple[Attempt, Rollout | None]:
        """One proposal as far as it gets, and its rollout where it gets that far."""
        kept = advice.keep_path
        path = kept if kept and self._open(kept, situation) else await proposer.planning.plan(situation, advice)
        if isinstance(path, Revise):
            return Attempt(number, None, None, path), None
        if not self._open(path, situation):
            raise NoAdmissiblePlan(f"{proposer.name}: {' > '.join(path.states)} is not open now")
        actions = await proposer.action.act(situation, path, advice)
        if isinstance(actions, Revise):
            return Attempt(number, path, None, actions), None
        for before in advice.attempts:
            if before.actions is not None and before.actions.digest == actions.digest:
                return Attempt(number, path, actions, Revise((repetition_finding(before.number),))), None
        situation = await self._fresh(situation)
        if not self._open(path, situation):  # a guard closed while somebody thought about the commands
            return Attempt(number, path, None, Revise((closed_finding(path.states),))), None
        rollout = await self._crew.simulation.roll_out(situation.diagnosis, actions)
        verdict = self._crew.validation.judge(actions, rollout, self._machine.state(path.target), path)
        return Attempt(number, path, actions, verdict, len(rollout.weights)), rollout

    def _open(self, path: RecoveryPath, situation: Situation) -> bool:
        """Whether the machine lets the plant take ``path`` now, which no proposer is trusted with."""
        values = situation.snapshot.values
        return (
            path.machine == self._machine
            and path.states[0] == situation.state
            and self._machine.state(path.target).recovery_target
            and all(t.guard.holds(values) for t in path.decisions)
        )

    async def _ask_proposers(self, situation: Situation, idle: Rollout | None, began: float) -> Released:
        """Ask one proposer after the other, each within its time, until one's action set is released.

        The time counts from ``began``, by the event loop's clock, when the plant was looked at. The last one's failure
        is everyone's. Where the plant may also be left alone, only those are asked whose business it is to improve.
        """
        proposers = [p for p in self._crew.proposers if idle is None or p.improves]
        if idle is not None and not self._restraint.worthwhile(idle):
            raise NoAdmissiblePlan("the plant already produces what it can")
        end = began + self._clock.wall_s(situation.deadline_s)
        reason: Exception = NoAdmissiblePlan("nobody proposes anything")
        for proposer in proposers:
            last = proposer is proposers[-1]
            try:
                return await self._ask(proposer, situation, idle, end if last else end - self._budget.last_s)
            except TimeoutError as late:
                reason, text = late, f"{proposer.name}: no approved proposal in the time that was left for it"
            except (NoAdmissiblePlan, Refused) as failed:
                reason, text = failed, str(failed)
            self._trace.record(GaveUp(proposer.name, text), self._seen_s)
        raise reason

    async def _ask(self, proposer: Proposer, situation: Situation, idle: Rollout | None, end: float) -> Released:
        """Let ``proposer`` find something until ``end`` (time of the event loop) and release it; again if overtaken."""
        while True:
            async with asyncio.timeout_at(end):
                found = await self.deliberate(proposer, situation, idle)
            try:
                return await self._release(found, situation.diagnosis)
            except Overtaken:
                situation = await self._fresh(situation)

    async def _release(self, found: Approved, diagnosis: Diagnosis) -> Released:
        """Let the gate release what was approved; Refused where it does not hold any more."""
        self._rehearsal.prepare(diagnosis, self._machine.state(found.path.target), found.path)
        released = await self._gate.release(found.actions, found.approval, self._seen_s, found.path.states[0])
        if self._rehearsal.last is not None:
            self._expectation.expect(found.actions.then, self._rehearsal.last)
        self._note_release(found, released, diagnosis)
        return released

    async def _fresh(self, situation: Situation) -> Situation:
        """The same question about the plant as it is now, and the time left now: it ran on while somebody thought."""
        seen = await self._plant.since(self._seen_s)
        self._remember(seen)
        self._crew.simulation.observe(seen)
        left_s = situation.deadline_s - (seen[-1].at_s - situation.snapshot.at_s)
        return replace(
            situation, snapshot=seen[-1], recent=tuple(self._recent), state=self._sequencer.state,
            deadline_s=max(left_s, SHORTEST_S), rest=self._sequencer.way(),
            under_way=self._sequencer.rest().commands,
        )  # fmt: skip

    async def _look(self, diagnosis: Diagnosis) -> Rollout:
        """Take a fresh look at the plant; what happens if nothing is done."""
        seen = await self._plant.since(self._seen_s)
        self._remember(seen)
        self._crew.simulation.observe(seen)
        rest = self._sequencer.rest()
        idle = await self._crew.simulation.roll_out(diagnosis, rest)
        self._expectation.expect(rest.then, idle)
        return idle

    async def _predict(self) -> None:
        """Say when steps should be taken if nothing is wrong, where nobody has said so: the nominal route."""
        rest = self._sequencer.rest()
        if self._expectation.lacks(rest.then) and len(self._recent) >= FIRST_LOOK:
            self._crew.simulation.observe(tuple(self._recent))
            healthy = Diagnosis(self._seen_s, (), ())
            self._expectation.expect(rest.then, await self._crew.simulation.roll_out(healthy, rest))

    def _judge_idle(self, idle: Rollout) -> Verdict:
        """What follows if nobody interferes: the steps that are left, if any."""
        rest = self._sequencer.rest()
        return self._crew.validation.judge(rest, idle, self._machine.state(rest.end), self._sequencer.way())

    def _remember(self, snapshots: Sequence[Snapshot]) -> None:
        """Keep what was seen, each second once."""
        for snapshot in snapshots:
            if not self._recent or snapshot.at_s > self._recent[-1].at_s:
                self._recent.append(snapshot)
        self._seen_s = max(self._seen_s, snapshots[-1].at_s)

    async def _arm_fallback(self, diagnosis: Diagnosis) -> ValidatedFallback:
        """Validate the safe-state strategies on the twin and have the best one ready."""
        rollouts = [(s, await self._crew.simulation.roll_out(diagnosis, s.actions)) for s in self._fallbacks]
        best = choose(rollouts, self._limits)
        self._gate.arm(best.strategy)
        return best

    @property
    def _step_is_due(self) -> bool:
        """Whether every state is asked about, and this one was not yet, or a while ago in vain."""
        state, at_s = self._asked
        stands = self._sequencer.way() is None and self._seen_s - at_s >= self._patience.repeat_s
        due = self._every_step and (self._sequencer.state != state or stands)
        return due and not self._finished and len(self._recent) >= FIRST_LOOK

    @property
    def _finished(self) -> bool:
        """Whether nothing but the fallback leads out of the present state: a batch that is complete."""
        return self._machine.is_end(self._sequencer.state, EVENT)

    @property
    def _rules(self) -> frozenset[str]:
        """Names of the symptoms that are active."""
        return frozenset(s.rule for s in self._crew.monitoring.symptoms)

    @property
    def _judged(self) -> bool:
        """Whether the batch is over, and safe with every symptom that there is: nothing is left to review."""
        return self._finished and self._rules <= self._accepted

    @property
    def _recovered(self) -> bool:
        """Whether something was released before."""
        return math.isfinite(self._released_s)

    def _leave_alone(self, verdict: Approve | Revise) -> LeftAlone:
        worst = min(f.margin for f in verdict.findings)
        self._trace.record(LeftAsIs(self._sequencer.state, worst), self._seen_s)
        return LeftAlone(self._seen_s, worst)

    async def _hand_over(self, reason: str, thought: bool = False, unattended: bool = False) -> HandedOver:
        """Let the fallback act and say why; after thinking (``thought``) the plant was last seen a while ago."""
        strategy = await self._gate.fall_back(reason, unattended)
        if thought:
            self._remember(await self._plant.since(self._seen_s))
        self._trace.record(FellBack(strategy.name, strategy.actions.commands, reason), self._seen_s)
        return HandedOver(reason, self._seen_s)

    def _note_release(self, found: Approved, released: Released, diagnosis: Diagnosis) -> None:
        if diagnosis.faulty or not self._every_step:  # a step as usual is no recovery
            self._released_s = released.at_s
        self._seen_s = max(self._seen_s, released.at_s)
        event = ReleasedActions.of(found.proposer, found.actions, found.approval.min_margin)
        self._trace.record(event, released.at_s)
        self._note_states()

    def _note_states(self) -> None:
        """Record the states that the sequencer entered since it was last asked."""
        for state, at_s in self._sequencer.drain():
            self._trace.record(StateEntered(state), at_s)
            self._expectation.entered(state, at_s, len(self._sequencer.rest().then))


def _armed(fallback: ValidatedFallback, deadline_s: float) -> FallbackArmed:
    approved = isinstance(fallback.verdict, Approve)
    return FallbackArmed(fallback.strategy.name, approved, fallback.findings, deadline_s)
