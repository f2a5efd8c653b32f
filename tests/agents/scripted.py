"""Agents that follow a script: real implementations of the roles whose answers a test decides."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Mapping, Sequence

from homeostat.agents.certificates import Course
from homeostat.agents.reliance import Relying
from homeostat.agents.roles import Hold, NoAdmissiblePlan, Plan, Probe, Situation, Wait
from homeostat.domain.advice import Advice, Attempt, Sensitivity
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis, Symptom
from homeostat.domain.events.recovery import Retrieved
from homeostat.domain.plant.state_machine import State, StateMachine
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding, Resolution, Revise, Rollout, Verdict
from homeostat.twin.twin import Interruption

SYMPTOM = Symptom("S-HOT", 0.0, 2.0, 1.0, 2.0)


def diagnosis(at_s: float, fault: str = "runaway", severity: float = 1.0) -> Diagnosis:
    """One sure hypothesis with one symptom."""
    return Diagnosis(at_s, (SYMPTOM,), (Hypothesis((FaultState(fault, severity, at_s),), 1.0),))


class ScriptedMonitoring:
    """Implements `homeostat.agents.roles.Monitoring`: notices at the given times, and remembers what was done."""

    def __init__(
        self, *notice_s: float, answer: Callable[[float], Diagnosis] = diagnosis, bug: BaseException | None = None
    ) -> None:
        """``bug`` is raised by `diagnose`."""
        self._notice_s = set(notice_s)
        self._answer = answer
        self._bug = bug
        self._at_s = 0.0
        self.seen: list[float] = []
        self.outcomes: list[Resolution] = []
        self.diagnosed: list[float] = []
        self.deviations: list[bool] = []

    def notices(self, snapshot: Snapshot) -> bool:
        self._at_s = snapshot.at_s
        self.seen.append(snapshot.at_s)
        return snapshot.at_s in self._notice_s

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        return (SYMPTOM,) if self._at_s in self._notice_s else ()

    def diagnose(self, deviates: bool = False) -> Diagnosis:
        self.deviations.append(deviates)
        self.diagnosed.append(self._at_s)
        if self._bug is not None:
            raise self._bug
        return self._answer(self._at_s)

    def follow(self, outcome: Resolution) -> None:
        self.outcomes.append(outcome)


class ScriptedPlanning:
    """Implements `homeostat.agents.roles.Planning`: one path after the other, the last one for ever."""

    def __init__(
        self, machine: StateMachine, *paths: Sequence[str] | Plan | Revise | BaseException, delay_s: float = 0.0
    ) -> None:
        """``paths``: names of transitions, or what to raise; `NoAdmissiblePlan` where there is none."""
        self._machine = machine
        self._paths = list(paths)
        self._delay_s = delay_s
        self.asked: list[tuple[Situation, Advice]] = []

    async def plan(self, situation: Situation, advice: Advice) -> Plan | Revise:
        self.asked.append((situation, advice))
        await asyncio.sleep(self._delay_s)
        if not self._paths:
            raise NoAdmissiblePlan("the script has no path")
        answer = self._paths[min(len(self.asked), len(self._paths)) - 1]
        if isinstance(answer, BaseException):
            raise answer
        if isinstance(answer, Revise | Wait | Hold | Probe):
            return answer
        by_name = {t.name: t for t in self._machine.transitions}
        assert not isinstance(answer, RecoveryPath)
        return RecoveryPath(self._machine, tuple(by_name[name] for name in answer))


class ScriptedAction:
    """Implements `homeostat.agents.roles.Action`: one answer after the other, the last one for ever."""

    def __init__(
        self, *answers: ActionSet | Revise | BaseException, delay_s: float = 0.0, thread_s: float = 0.0
    ) -> None:
        """``delay_s``: thinking that can be interrupted; ``thread_s``: in a thread, which only ``compute_on`` can."""
        self._answers = list(answers)
        self._delay_s, self._thread_s = delay_s, thread_s
        self.asked: list[tuple[Situation, RecoveryPath, Advice]] = []
        self.compute_on, self.computed = threading.Event(), threading.Event()
        """Set by a test: the thread need not compute any more; set by the thread: it has ended."""

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet | Revise:
        self.asked.append((situation, path, advice))
        await asyncio.sleep(self._delay_s)
        if self._thread_s:
            await asyncio.to_thread(self._compute)
        answer = self._answers[min(len(self.asked), len(self._answers)) - 1]
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def _compute(self) -> None:
        self.compute_on.wait(self._thread_s)
        self.computed.set()


class ScriptedSimulation:
    """Implements `homeostat.agents.roles.Simulation`: a function says what an action set does."""

    def __init__(self, answer: Callable[[ActionSet], Rollout], errors: tuple[Mapping[str, float], ...] = ({},)) -> None:
        self._answer = answer
        self._errors = errors
        self.observed: list[Snapshot] = []
        self.tried: list[ActionSet] = []

    def observe(self, snapshots: tuple[Snapshot, ...]) -> None:
        self.observed += snapshots

    def instrument_errors(self, diagnosis: Diagnosis) -> tuple[Mapping[str, float], ...]:
        return self._errors

    async def roll_out(self, diagnosis: Diagnosis, actions: ActionSet, ended: Interruption | None = None) -> Rollout:
        self.tried.append(actions)
        return self._answer(actions)

    async def relied_on(self, diagnosis: Diagnosis, asked: Relying, rollout: Rollout) -> tuple[Finding, ...]:
        return ()

    async def violations(
        self, diagnosis: Diagnosis, courses: Sequence[Course], draws: int
    ) -> AsyncIterator[int | None]:
        for _ in courses:
            yield 0

    async def sensitivities(
        self, diagnosis: Diagnosis, actions: ActionSet, states: Sequence[State], criteria: Sequence[str]
    ) -> tuple[Sensitivity, ...]:
        return ()


class ScriptedValidation:
    """Implements `homeostat.agents.roles.Validation`: a function judges."""

    def __init__(self, answer: Callable[[ActionSet, Rollout, State], Verdict]) -> None:
        self._answer = answer

    def judge(self, actions: ActionSet, rollout: Rollout, target: State, path: RecoveryPath | None = None) -> Verdict:
        return self._answer(actions, rollout, target)


class ScriptedReprompting:
    """Implements `homeostat.agents.roles.Reprompting`: hands the findings on and asks for another path each time."""

    def __init__(self, bug: BaseException | None = None) -> None:
        self._bug = bug

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        if self._bug is not None:
            raise self._bug
        violated = tuple(f for f in attempt.verdict.findings if not f.satisfied)
        return Advice(findings=violated, tries=before.tries + 1)


class NoGraph:
    """Stands where the knowledge graph is not asked: no context, nothing retrieved."""

    def candidate_faults(self, symptoms: Sequence[str]) -> tuple[str, ...]:
        return ()

    def allows(self, states: Sequence[str], faults: Sequence[str]) -> bool:
        return True

    def drain(self) -> tuple[Retrieved, ...]:
        return ()
