"""The reactor a moment after each of its faults began: what language agents are asked about, with a real twin."""

from __future__ import annotations

import asyncio
import contextlib
import functools
from dataclasses import dataclass, field, replace

from homeostat.agents.language.action import LanguageAction
from homeostat.agents.language.planning import LanguagePlanning
from homeostat.agents.language.reprompting import TeachingReprompting
from homeostat.agents.language.scripts import reasonable, stubborn
from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis, Symptom
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Revise
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.recovery.scene import RECENT
from tests.agents.briefings import briefing
from tests.agents.stuck_valve import grounding
from tests.twin.followed import follow, reactor, readings

NOW_S, ONSET_S = 1520, 1450.0
FAULTS = tuple(fault.name for fault in reactor().description.faults)


@functools.cache
def simulation(fault: str) -> TwinSimulation:
    """A twin that has followed the reactor until ``fault`` was noticed."""
    d = reactor().description
    return TwinSimulation(follow(readings(3, NOW_S, (state(fault),))), d.tags_by_name, d.limits)


def state(fault: str) -> FaultState:
    """The fault with its typical size."""
    return FaultState(fault, reactor().description.fault(fault).severity_nominal, ONSET_S)


def diagnosed(fault: str) -> Diagnosis:
    """The fault in two sizes, another one that is less likely, and that nothing is wrong."""
    true = state(fault)
    other = state(next((name for name in FAULTS if name > fault), FAULTS[0]))
    rules = [rule for rule in reactor().description.symptom_rules if fault in rule.faults]
    symptoms = tuple(Symptom(rule.name, NOW_S - 10.0, 2.0, 1.0, 2.0 - 0.1 * k) for k, rule in enumerate(rules))
    hypotheses = (
        Hypothesis((true,), 0.6), Hypothesis((replace(true, severity=0.9 * true.severity),), 0.2),
        Hypothesis((other,), 0.15), Hypothesis((), 0.05),
    )  # fmt: skip
    return Diagnosis(float(NOW_S), symptoms, hypotheses)


@functools.cache
def situation(fault: str) -> Situation:
    """What a proposer is asked about ``fault``, as recovery puts it."""
    d, snapshots = reactor().description, readings(3, NOW_S, (state(fault),))
    idle = ActionSet((), "normal")
    rollout = asyncio.run(simulation(fault).roll_out(diagnosed(fault), idle))
    verdict = LimitValidation(d.limits, d.tags_by_name).judge(idle, rollout, d.machine.state("normal"))
    cost = Pricing(reactor().prices, d.limits, d.scales).of(rollout, ("normal",))
    recent = snapshots[-RECENT:]
    return Situation(snapshots[-1], diagnosed(fault), "normal", recent, verdict.findings, 25.0, idle_cost=cost)


@dataclass
class Agents:
    """The language agents around one scripted model, and the loop's share of work."""

    model: ScriptedModel
    fault: str = "cool_stuck_closed"
    notes: tuple[str, ...] = ()
    attempts: list[Attempt] = field(default_factory=list)

    def __post_init__(self) -> None:
        situation(self.fault)
        self.briefing = told = briefing(self.model, reactor(), simulation(self.fault), self.notes, grounding())
        self.planning, self.action = LanguagePlanning(told), LanguageAction(told)
        self.reprompting = TeachingReprompting(told)

    async def attempt(self, advice: Advice) -> Advice:
        """One attempt after ``advice``, and the advice after it; like recovery's, without its bookkeeping."""
        d, now, number = reactor().description, situation(self.fault), len(self.attempts) + 1
        path = advice.keep_path or await self.planning.plan(now, advice)
        if isinstance(path, Revise):
            return await self.learn(now, Attempt(number, None, None, path), advice)
        actions = await self.action.act(now, path, advice)
        if isinstance(actions, Revise):
            return await self.learn(now, Attempt(number, path, None, actions), advice)
        rollout = await simulation(self.fault).roll_out(now.diagnosis, actions)
        verdict = LimitValidation(d.limits, d.tags_by_name).judge(actions, rollout, d.machine.state(path.target))
        return await self.learn(now, Attempt(number, path, actions, verdict, len(rollout.weights)), advice)

    async def learn(self, now: Situation, attempt: Attempt, advice: Advice) -> Advice:
        """The advice after ``attempt``, with every earlier one."""
        self.attempts.append(attempt)
        after = await self.reprompting.advise(now, attempt, advice)
        return replace(after, attempts=tuple(self.attempts))


@functools.cache
def questions(fault: str) -> tuple[Question, ...]:
    """Planning and action asked once, and both again after an attempt that did not help."""
    model, now = ScriptedModel("scripted:reasonable", reasonable), situation(fault)
    agents = Agents(model, fault)
    weak = Agents(ScriptedModel("scripted:stubborn", stubborn), fault)

    async def ask() -> None:
        path = await agents.planning.plan(now, Advice())
        assert isinstance(path, RecoveryPath)
        await agents.action.act(now, path, Advice())
        advice = await weak.attempt(Advice())
        await agents.action.act(now, path, advice)
        with contextlib.suppress(NoAdmissiblePlan):  # where only one path is open
            await agents.planning.plan(now, replace(advice, refused_paths=(path.commanded,)))

    asyncio.run(ask())
    return tuple(model.asked)
