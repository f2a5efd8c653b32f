"""How long a decision takes on this host: 1,000 rollouts, a search, an entry of the playbook."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial

from benchmarks.engine import best_s
from benchmarks.unknown.causes import Cause
from homeostat.agents.playbook.book import Book
from homeostat.agents.roles import Plan, Proposer, Situation
from homeostat.domain.advice import Advice
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Revise
from homeostat.evaluate import runner
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.scenario import Fault, departing, scenario_of
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import ThinkingClock
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Workbench, in_operation
from homeostat.process.batch import simulate, use_threads
from tests.plants.cstr.reactor import MODEL, S, batch

ROLLOUTS, HORIZON_S = 1000, 1500
"""Rollouts in one call of the engine, and how far each goes [s]."""


class Timed:
    """Planning and action of a proposer, timed by the wall clock."""

    def __init__(self, own: Proposer) -> None:
        self._own = own
        self.took_s = 0.0
        """All thinking so far [s]."""
        self.asked = 0
        """How often commands were asked for."""

    async def plan(self, situation: Situation, advice: Advice) -> Plan | Revise:
        """As the proposer behind it."""
        began = time.perf_counter()
        try:
            return await self._own.planning.plan(situation, advice)
        finally:
            self.took_s += time.perf_counter() - began

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet | Revise:
        """As the proposer behind it."""
        began, self.asked = time.perf_counter(), self.asked + 1
        try:
            return await self._own.action.act(situation, path, advice)
        finally:
            self.took_s += time.perf_counter() - began


@dataclass(frozen=True, slots=True)
class Thought:
    """One run, timed by the wall clock while nothing else is under way."""

    fault: str
    seed: int
    decision_s: float
    """Thinking from what led to the first action to that action: diagnosis, proposals and judgement [s]."""
    proposals_s: dict[str, float]
    """Proposer -> its own thinking for each proposal, in the mean of the run [s]; without those never asked."""


def measure_thought(plant: Plant, cause: Cause, seed: int, mismatch: str, book: Book | None = None) -> Thought:
    """Run a fault of the tables with everything on, with what the ``book`` holds; thinking costs what it takes."""
    (state,) = cause.faults
    told = scenario_of(plant, [Fault(state.fault, state.severity, state.onset_s)], seed)
    timed: dict[str, Timed] = {}

    def propose(bench: Workbench) -> tuple[Proposer, ...]:
        proposers = in_operation(bench)
        timed.update({own.name: Timed(own) for own in proposers})
        return tuple(replace(own, planning=timed[own.name], action=timed[own.name]) for own in proposers)

    proposing = Proposing(propose=propose, playbook=book)
    run = runner.run(plant, departing(plant, told, (), mismatch), MemoryTrace(), ThinkingClock(), proposing)
    each = {name: one.took_s / one.asked for name, one in timed.items() if one.asked}
    return Thought(state.fault, seed, run.thinking_s, each)


def rollouts_s(repeat: int = 3) -> float:
    """Shortest wall-clock time of :data:`ROLLOUTS` rollouts with noise over :data:`HORIZON_S`, on two threads [s]."""
    use_threads(2)
    crowd = replace(
        batch(HORIZON_S, members=ROLLOUTS, stride=60, process=1.0, sensor=1.0), record=(S.V, S.T, S.V2_position)
    )
    try:
        return best_s(partial(simulate, MODEL.kernel, crowd), repeat)
    finally:
        use_threads(1)
