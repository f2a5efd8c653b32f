"""Deliberation: plan, act, simulate, validate and reprompt; what is approved joins the alternatives."""

import asyncio
import math
from collections.abc import Awaitable
from dataclasses import replace
from typing import TypeVar

from homeostat.agents.checks import closed_finding, repetition_finding
from homeostat.agents.roles import (
    Agents,
    Approved,
    Hold,
    NoAdmissiblePlan,
    Plan,
    Probe,
    Proposer,
    Situation,
    Wait,
)
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Attempted, NotAsked, Remarked
from homeostat.domain.quotation import quote
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.remark import RemarkKind
from homeostat.domain.verdict import Approve, Finding, Revise
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.choices import Testing
from homeostat.recovery.judging import Follow, Judged, Judging, unholdable
from homeostat.recovery.scene import Scene
from homeostat.recovery.worth_asking import AnswerTimes, Worth

T = TypeVar("T")


class Deliberation:
    """One proposer's attempts in one recovery."""

    def __init__(
        self, proposer: Proposer, scene: Scene, agents: Agents, judging: Judging, times: AnswerTimes, most: int
    ) -> None:
        """``times``: how long answers take; ``most``: attempts that it has."""
        self.proposer = proposer
        self._scene, self._agents, self._judging, self._times = scene, agents, judging, times
        self._since: float | None = None
        """Process time at which the answer was asked for that is under way [s]."""
        self._advice, self._number, self._most = Advice(), 0, most
        self._by_hand: dict[str, ActionSet] = {}
        self._bettered: set[tuple[str, ...]] = set()

    async def add_to(self, alternatives: Alternatives, situation: Situation, end: float, soon: float) -> None:
        """Propose until what is approved is the cheapest, a thorough proposer until nothing cheaper can be found.

        The numbers of one that is not thorough are bettered by the search, where that finds cheaper ones on the same
        path. Whoever has found something and has nothing better to say has not given up. ``end``: time of the event
        loop at which thinking ends, ``soon``: at which it does where anything is approved [s]. NoAdmissiblePlan and
        TimeoutError where nothing was found.
        """
        try:
            await self._propose(alternatives, situation, end, soon)
        finally:
            self._answered()

    async def _propose(self, alternatives: Alternatives, situation: Situation, end: float, soon: float) -> None:
        found, before = False, self._number
        self._bettered.clear()
        if not self._pays(alternatives, situation):
            return
        while self._number < self._most:
            worth = _worth(alternatives, situation)
            dear = math.inf if worth is None else self._scene.end(asyncio.get_running_loop().time(), worth.longest_s)
            until = min(dear, end if alternatives.best is None else min(end, soon))
            try:
                async with asyncio.timeout_at(until):
                    situation = replace(await self._scene.fresh(situation), best=alternatives.cheapest)
                    self._answered()
                    if self._number > before and not self._pays(alternatives, situation):
                        return
                    self._since = self._scene.seen_s
                    try:
                        judged = await self._attempt(self._number + 1, situation, alternatives)
                    finally:
                        self._tell()
                    self._number += 1
                    if not (taken := self._take(judged, alternatives)):
                        await self._reprompt(situation, judged.attempt)
            except TimeoutError:
                await self._scene.look()  # what was waited for in vain took time as well
                if worth is not None and asyncio.get_running_loop().time() >= dear:
                    return self._stop(worth, worth.longest_s, alternatives.currency)
                if found:
                    return
                raise
            except NoAdmissiblePlan:
                if found:
                    return
                raise
            found = found or taken
            if taken and not self.proposer.thorough:
                await self._polish(judged.attempt, alternatives, situation, min(end, soon))
                if not self._may_better(alternatives, min(end, soon)):
                    return
        if not found:
            raise NoAdmissiblePlan(f"{self.proposer.name}: no proposal was approved in {self._most} attempts")

    def _answered(self) -> None:
        """Note how long the answer has taken that was asked for last."""
        if self._since is not None:
            self._times.took(self.proposer.name, self._scene.seen_s - self._since)
        self._since = None

    def _pays(self, alternatives: Alternatives, situation: Situation) -> bool:
        """Whether the next answer may win what waiting for it costs; where it may not, that is said."""
        worth, answer_s = _worth(alternatives, situation), self._times.expected_s(self.proposer.name)
        if worth is None or worth.pays(answer_s):
            return True
        self._stop(worth, answer_s, alternatives.currency)
        return False

    def _stop(self, worth: Worth, answer_s: float, currency: str) -> None:
        self._scene.record(NotAsked(self.proposer.name, answer_s, worth.lost(answer_s), worth.gain, currency))

    def _may_better(self, alternatives: Alternatives, end: float) -> bool:
        """Whether something costs less than what is approved of its own, and until ``end`` more may be won."""
        own = [a.cost.total for a in self._advice.attempts if isinstance(a.verdict, Approve) and a.cost is not None]
        cheapest = alternatives.cheapest
        beaten = cheapest is not None and cheapest.cost.total < min(own, default=math.inf)
        return beaten and not alternatives.suffices and asyncio.get_running_loop().time() < end

    def _tell(self) -> None:
        """Record what the proposer said besides; a cause that no table lists is for a person, who is called."""
        for remark in () if self.proposer.remarks is None else self.proposer.remarks.drain():
            self._scene.record(Remarked.of(self.proposer.name, remark))
            if remark.kind is RemarkKind.UNLISTED_CAUSE:
                said = f"{self.proposer.name} suspects {remark.about}: {quote(remark.text, 200)}"
                self._scene.alarm(
                    f"unlisted-cause:{remark.about}", f"{said}; nothing was decided by it, look at {remark.about}"
                )

    async def _unless_it_hangs(self, work: Awaitable[T]) -> T:
        """One answer; TimeoutError where it never comes: what it is part of may have no end."""
        async with asyncio.timeout_at(self._scene.cut()):
            return await work

    @property
    def attempts(self) -> tuple[Attempt, ...]:
        """What it has proposed so far."""
        return self._advice.attempts

    def _take(self, judged: Judged, alternatives: Alternatives) -> bool:
        """Record an attempt; whether it is approved, and one of the ``alternatives`` now."""
        attempt = judged.attempt
        self._scene.record(Attempted.of(self.proposer.name, attempt))
        if judged.found is None:
            return False
        alternatives.add(judged.found)
        took = (attempt.path.commanded,) if attempt.path is not None and self.proposer.thorough else ()
        refused = (*self._advice.refused_paths, *took)
        self._advice = Advice(refused_paths=refused, attempts=(*self._advice.attempts, attempt))
        return True

    async def _polish(self, attempt: Attempt, alternatives: Alternatives, situation: Situation, end: float) -> None:
        """Let the search better the numbers of an approved ``attempt``; where time is over it stands as it is."""
        polishing, path, actions = self._agents.polishing, attempt.path, attempt.actions
        if polishing is None or path is None or actions is None or attempt.kind is not AlternativeKind.RELEASE:
            return
        try:
            async with asyncio.timeout_at(self._scene.cut(end)):
                better = await polishing.polish(situation, path, actions)
                self._bettered.add(path.commanded)
                if better.digest == actions.digest:
                    return
                name = self.proposer.name
                polished = await self._judging.proposal(name, attempt.number, situation, path, better)
        except (NoAdmissiblePlan, TimeoutError):
            return
        found = polished.found
        bettered = replace(found, polished=True) if isinstance(found, Approved) else None
        self._take(Judged(replace(polished.attempt, polished=True), bettered), alternatives)

    async def refused(
        self, found: Approved | Testing, findings: tuple[Finding, ...], situation: Situation, end: float
    ) -> None:
        """Teach the next attempt what the release check or the guard said of what was ``found``."""
        before, what = self._advice, found.admitted.probe if isinstance(found, Testing) else found
        states = () if what.path is None else what.path.commanded
        attempt = next((a for a in reversed(before.attempts) if a.actions == what.actions), None)
        if attempt is None:
            return
        self._advice = replace(
            before,
            refused_paths=tuple(p for p in before.refused_paths if p != states),
            attempts=tuple(a for a in before.attempts if a is not attempt),
        )
        async with asyncio.timeout_at(end):
            # The members of a check are others than those of the attempt: what they follow is not known.
            await self._reprompt(situation, replace(attempt, verdict=Revise(findings), hypotheses=()))

    async def _reprompt(self, situation: Situation, attempt: Attempt) -> None:
        try:
            after = await self._unless_it_hangs(self.proposer.reprompting.advise(situation, attempt, self._advice))
        finally:
            self._tell()
        self._advice = replace(after, attempts=(*self._advice.attempts, attempt))

    async def _attempt(self, number: int, situation: Situation, alternatives: Alternatives) -> Judged:
        """One proposal as far as it gets."""
        proposer, advice, judging, name = self.proposer, self._advice, self._judging, self.proposer.name
        kept = advice.keep_path
        if kept is not None and self._judging.is_open(kept, situation):
            plan: Plan | Revise = Hold(kept, advice.keep_s) if advice.keep_s else kept
        else:
            plan = await self._unless_it_hangs(proposer.planning.plan(situation, advice))
        match plan:
            case Revise():
                return Judged(Attempt(number, None, None, plan), None)
            case Wait(seconds=seconds):
                if (again := _said_before(advice, AlternativeKind.WAIT, seconds, "")) is not None:
                    told = Attempt(number, None, self._scene.now.rest, self._repetition(again))
                    return Judged(replace(told, kind=AlternativeKind.WAIT, seconds=seconds), None)
                situation = await self._scene.fresh(situation)
                return await judging.wait(name, number, situation, seconds, _follow(alternatives))
            case Probe():
                tested = (a for a in advice.attempts if a.kind is AlternativeKind.TEST and a.actions == plan.actions)
                if (again := next(tested, None)) is not None:
                    return Judged(replace(again, number=number, verdict=self._repetition(again), members=0), None)
                return await judging.test(name, number, situation, plan, _follow(alternatives))
            case Hold(path=path, seconds=seconds):
                pass
            case RecoveryPath() as path:
                if path.commanded in self._bettered:
                    text = f"the search has bettered its numbers on {' > '.join(path.states)}"
                    raise NoAdmissiblePlan(f"{name}: {text}, and it names nothing else")
                seconds = 0.0
        return await self._acted(number, situation, path, seconds)

    async def _acted(self, number: int, situation: Situation, path: RecoveryPath, seconds: float) -> Judged:
        """The commands on a ``path`` that is to be taken for so many ``seconds``; for good where they are none."""
        proposer, advice, judging = self.proposer, self._advice, self._judging
        kind = AlternativeKind.HOLD if seconds else AlternativeKind.RELEASE

        def refused(verdict: Revise, actions: ActionSet | None = None) -> Judged:
            return Judged(Attempt(number, path, actions, verdict, kind=kind, seconds=seconds), None)

        if not self._judging.is_open(path, situation):
            raise NoAdmissiblePlan(f"{proposer.name}: {' > '.join(path.states)} is not open now")
        if seconds and (no_hold := unholdable(path)) is not None:  # before somebody thinks about commands in vain
            return refused(no_hold)
        actions = await self._unless_it_hangs(proposer.action.act(situation, path, advice))
        if isinstance(actions, Revise):
            return refused(actions)
        if self._agents.polishing is not None and not proposer.thorough:
            said = actions.digest
            if said not in self._by_hand:
                tracked = self._agents.polishing.tracked(situation, path, actions)
                self._by_hand[said] = await self._unless_it_hangs(tracked)
            actions = self._by_hand[said]  # the same answer is the same proposal, so that a repetition is noticed
        if (again := _said_before(advice, kind, seconds, actions.digest)) is not None:
            return refused(self._repetition(again), actions)
        situation = await self._scene.fresh(situation)
        if not self._judging.is_open(path, situation):  # a guard closed while somebody thought about the commands
            return refused(Revise((closed_finding(path.states),)))
        if seconds:
            return await judging.hold(proposer.name, number, situation, path, actions, seconds)
        return await judging.proposal(proposer.name, number, situation, path, actions)

    def _repetition(self, before: Attempt) -> Revise:
        """The refusal of what was said ``before``; NoAdmissiblePlan where that is approved: it has nothing better."""
        if isinstance(before.verdict, Approve):
            raise NoAdmissiblePlan(f"{self.proposer.name}: says attempt {before.number} again, which is approved")
        return Revise((repetition_finding(before.number),))


def _said_before(advice: Advice, kind: AlternativeKind, seconds: float, digest: str) -> Attempt | None:
    """The attempt that was the same; None where none was. ``digest``: of its commands, none for a wait."""
    for a in advice.attempts:
        same = not digest or (a.actions is not None and a.actions.digest == digest)
        if a.kind is kind and a.seconds == seconds and same:
            return a
    return None


def _follow(alternatives: Alternatives) -> Follow | None:
    """The best approved proposal so far."""
    best = alternatives.lasting
    return None if best is None else Follow.of(best.actions, best.path)


def _worth(alternatives: Alternatives, situation: Situation) -> Worth | None:
    """What one more answer is worth, a test move that is on offer among what it may name."""
    return alternatives.worth(max((probe.value for probe in situation.tests), default=0.0))
