"""Proposals: proposers compete within their time, and the cheapest of what was approved is released."""

import asyncio
import math
from collections.abc import Coroutine, Iterable, Sequence
from dataclasses import replace

from homeostat.agents.hypotheses import may_pass
from homeostat.agents.roles import Agents, NoAdmissiblePlan, Situation
from homeostat.domain.diagnosis import FaultState
from homeostat.domain.events.recovery import GaveUp
from homeostat.domain.verdict import momentary
from homeostat.recovery.alternatives import Alternatives, digest_of, told
from homeostat.recovery.beside_fallback import BesideFallback
from homeostat.recovery.certifying import Certifying
from homeostat.recovery.choices import Waiting
from homeostat.recovery.deliberation import Deliberation
from homeostat.recovery.judging import Judging
from homeostat.recovery.nuisances import Nuisances
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.postponing import Postponing
from homeostat.recovery.releasing import Overtaken, Refused, Taken
from homeostat.recovery.scene import Scene
from homeostat.recovery.taking import Taking
from homeostat.recovery.worth_asking import AnswerTimes

MOST_EARLIER = 4
"""Most earlier decisions that proposers are told."""
UNLIKELY = 0.1
"""Probability of harm up to which something dear is put off, as long as it is as safe later as it is now [1]."""
LAST_SHARE = 0.25
"""Most of the time that is left which is kept for the waits [1]."""
AGAIN = 2
"""How often in a deliberation what circumstances alone refused is tried again before something else is [1]."""


class Proposals:
    """Asks the proposers, and has the best of what they found released."""

    def __init__(
        self, scene: Scene, agents: Agents, rules: PlantRules, judging: Judging, taking: Taking, bounds: Bounds
    ) -> None:
        """``judging`` says what may be done, ``taking`` does it."""
        self._scene, self._agents, self._times = scene, agents, AnswerTimes()
        self._judging, self._taking = judging, taking
        self._nuisances, self._postponing = (
            Nuisances(scene, agents, rules, judging),
            Postponing(scene, judging, rules.timing),
        )
        self._beside = BesideFallback(scene, judging)
        self._certifying = Certifying(scene, agents.simulation, bounds.risk)
        self._improvements, self._last_s = bounds.intervention.improvements, bounds.budget.last_s
        self._every_step, self._passing = bounds.every_step, set(rules.passing)
        self._decided: list[str] = []

    def passed(self, ended: Iterable[FaultState]) -> None:
        """Take note of what is over: what has ended once need not last where it comes again."""
        self._passing.update(f.fault for f in ended)

    async def ask(self, situation: Situation, alternatives: Alternatives, began: float) -> Taken:
        """Ask the proposers one after the other, and release the cheapest of what was approved.

        The time counts from ``began``, by the event loop's clock, when the plant was looked at [s]. Where the plant may
        also be left alone, only those are asked whose business it is to improve, and only what costs less is released.

        Raises:
            NoAdmissiblePlan: nobody has anything to propose, or nothing that costs less than leaving the plant alone.
            TimeoutError: the time is over.
            Withdrawn: what was asked for last was given up.
        """
        end = self._scene.end(began, situation.deadline_s)
        situation = replace(situation, earlier=tuple(self._decided[-MOST_EARLIER:]))
        while True:
            try:
                return await self._compete(situation, alternatives, end)
            except Overtaken:  # the plant went on to another state: whatever was found begins in the former one
                alternatives = alternatives.anew()
                situation = await self._scene.fresh(situation)

    async def _compete(self, situation: Situation, alternatives: Alternatives, end: float) -> Taken:
        """As :meth:`ask`, of a plant that stays in its state; Overtaken where it does not."""
        every = self._sessions(alternatives)
        asked, reason, again = every, Exception(), AGAIN
        while True:
            reason = await self._hear(asked, alternatives, situation, end) or reason
            if not self._every_step:
                tried = [(session.proposer.name, attempt) for session in every for attempt in session.attempts]
                await self._nuisances.add_to(alternatives, situation, tried, end)
            await self._postpone(every, alternatives, situation, end)
            best = alternatives.best
            if best is not None or alternatives.leave is not None:  # else the fallback is to act, and waits for nobody
                await self._certifying.add_to(alternatives, situation.diagnosis, end)
            self._scene.record(alternatives.event(digest_of(best)))
            if best is None:
                if alternatives.leave is not None and not isinstance(reason, TimeoutError):
                    raise NoAdmissiblePlan("nothing costs less than leaving the plant alone")
                raise reason if every else NoAdmissiblePlan("nobody proposes anything")
            try:
                taken = await self._taking.take(best, situation)
                self._decided.append(f"at {self._scene.seen_s:.0f} s {told(best)}")
                return taken
            except Refused as refusal:
                asked = []
                if again and momentary(refusal.findings):  # nothing is wrong with what was proposed
                    again -= 1
                    continue
                alternatives.refuse(best, str(refusal))
                reason = NoAdmissiblePlan(f"{best.proposer}: {refusal}")
                asked = [s for s in every if s.proposer.name == best.proposer]
                if isinstance(best, Waiting) or not asked:  # the waits of the list are nobody's, and nobody learns
                    continue
                failed = await self._try(asked[0], asked[0].refused(best, refusal.findings, situation, end))
                if failed is not None:  # whoever does not learn is not asked again
                    asked, reason = [], failed

    async def _postpone(
        self, every: Sequence[Deliberation], alternatives: Alternatives, situation: Situation, end: float
    ) -> None:
        """Add what may be done in place of the fallback, or of a release that costs more than leaving the plant alone.

        What need not last is waited for although no hard limit is in danger, or something dear is approved; before
        what is dear, so is what is unlikely to do harm, because more is known later.
        """
        passes = may_pass(situation.diagnosis, self._passing) and not self._every_step
        if every and alternatives.lacking and situation.act_by_s is not None:
            refused = [(session.proposer.name, attempt) for session in every for attempt in session.attempts]
            await self._beside.add_to(alternatives, situation, refused, end)
        if every and alternatives.lacking and (passes or situation.act_by_s is not None):
            await self._postponing.add_to(alternatives, situation, passes, end)
        elif (passes or self._unlikely(situation)) and (dear := alternatives.dear) is not None:
            await self._postponing.add_before(dear, alternatives, situation, end)

    def _unlikely(self, situation: Situation) -> bool:
        """Whether it is unlikely, and known how much so, that what goes on violates anything."""
        shares = [0.0 if f.violating is None else f.violating.share for f in situation.idle if not f.satisfied]
        return bool(shares) and min(shares) > 0.0 and max(shares) <= UNLIKELY and not self._every_step

    async def _hear(
        self, asked: Sequence[Deliberation], alternatives: Alternatives, situation: Situation, end: float
    ) -> Exception | None:
        """Let those who are ``asked`` add to the ``alternatives``; why the last that gave up did, None for nobody.

        Each is asked as long as an answer may win what waiting for it costs. Some time is kept for a thorough proposer
        that is still to be asked, and from whoever is not thorough for the waits that are tried after all proposers.
        Where the plant may not be left alone, half of the time is kept to release what is found in: what waits gets
        worse.
        """
        reason = None
        kept_s = 0.5 * self._scene.wall_s(situation.deadline_s) if alternatives.leave is None else 0.0
        for number, session in enumerate(asked, 1):
            if not alternatives.suffices:
                followed = any(s.proposer.thorough for s in asked[number:])
                until = end - self._last_s if followed else end if session.proposer.thorough else self._before(end)
                work = session.add_to(alternatives, situation, until, end - kept_s)
                reason = await self._try(session, work) or reason
        return reason

    def _before(self, end: float) -> float:
        """Time of the event loop that leaves the waits some of the time until ``end`` [s]."""
        now = asyncio.get_running_loop().time()
        return end if math.isinf(end) else end - min(self._last_s, LAST_SHARE * max(end - now, 0.0))

    async def _try(self, session: Deliberation, work: Coroutine[None, None, None]) -> Exception | None:
        """Wait for the ``work`` of one proposer; why it gave up, None where it did not."""
        failed: Exception
        name = session.proposer.name
        try:
            await work
            return None
        except TimeoutError as late:
            failed, text = late, str(late) or f"{name}: no approved proposal in the time that was left for it"
        except NoAdmissiblePlan as nothing:
            failed, text = nothing, str(nothing)
        except Exception as broken:  # a proposer may be anybody's: one that breaks is not the last that is asked
            failed, text = broken, f"{name} failed: {broken!r}"
        self._scene.record(GaveUp(name, text))
        return failed

    def _sessions(self, alternatives: Alternatives) -> list[Deliberation]:
        """One for every proposer that is asked."""
        leave = alternatives.leave is not None
        return [
            Deliberation(
                p,
                self._scene,
                self._agents,
                self._judging,
                self._times,
                min(p.attempts, self._improvements) if leave else p.attempts,
            )
            for p in self._agents.proposers
            if not alternatives.well or p.improves
        ]
