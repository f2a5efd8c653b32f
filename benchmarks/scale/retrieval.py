"""What the questions of the agents cost on a site: time, triples and tokens, asked about one module."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from benchmarks.scale.decisions import FAULTS
from benchmarks.scale.prompts import tokens
from homeostat.agents.grounding.grounding import Grounding
from homeostat.knowledge.context.context import Context
from homeostat.plants.plant import Plant

UNLIMITED = 1_000_000
"""Budget in which everything that was retrieved fits [tokens]."""
REPEAT = 7
"""How often each question is asked, each time by somebody who has asked nothing before."""


@dataclass(frozen=True)
class Retrieval:
    """One question about one module."""

    kind: str
    """Plant of the module."""
    question: str
    """Method of :class:`homeostat.agents.grounding.grounding.Grounding`."""
    median_ms: float
    """Median time, from the call to the text [ms]."""
    worst_ms: float
    """Longest time [ms]."""
    cpu_ms: float
    """Median time that the processor worked on it [ms]."""
    worst_cpu_ms: float
    """Longest time that the processor worked on it [ms]."""
    tokens: int
    """Tokens of everything that was retrieved; 0 for what is no context."""


def retrievals(plant: Plant) -> Iterator[Retrieval]:
    """Every question once per :data:`REPEAT` about ``case``, a module with the store of its site."""
    for name, ask in _questions(plant).items():
        times: list[float] = []
        worked: list[float] = []
        for _ in range(REPEAT):
            grounding = Grounding(plant.graph, plant.namespace)
            began, busy = time.perf_counter(), time.process_time()
            answer = ask(grounding)
            worked.append(1000.0 * (time.process_time() - busy))
            times.append(1000.0 * (time.perf_counter() - began))
        yield Retrieval(
            plant.name, name, statistics.median(times), max(times), statistics.median(worked), max(worked),
            tokens(answer.text) if isinstance(answer, Context) else 0,
        )  # fmt: skip


def context(plant: Plant) -> tuple[Context, ...]:
    """What planning and action are shown of ``case`` where nothing has to be left out."""
    grounding = Grounding(plant.graph, plant.namespace)
    found = (ask(grounding) for ask in _questions(plant).values())
    return tuple(shown for shown in found if isinstance(shown, Context))


def _questions(plant: Plant) -> dict[str, Callable[[Grounding], object]]:
    """Name -> question as it is asked when the first of the study's faults was diagnosed."""
    machine, fault = plant.description.machine, FAULTS[plant.name][0]
    event = machine.recovery_event
    symptoms = [rule.name for rule in plant.description.symptom_rules if fault in rule.faults]
    faults = (fault,)
    ends = [s.name for s in machine.states if s.recovery_target]
    planned = {t.target for t in machine.transitions if t.event == event}
    acting = [s for s in machine.states if s.open_setpoints and s.name in planned][:3]
    here = next(t.source for t in machine.transitions if t.event == event and t.target == acting[0].name)
    tags = sorted({r.tag for s in acting for r in s.open_setpoints})
    hard = [limit.name for limit in plant.description.limits.hard]
    states = [s.name for s in acting]
    return {
        "candidate_faults": lambda g: g.candidate_faults(symptoms),
        "allows": lambda g: g.allows((here, states[0]), faults),
        "planning_excerpt": lambda g: g.planning_context(here, event, ends, faults, UNLIMITED),
        "action_excerpt": lambda g: g.action_context(states, tags, faults, hard, UNLIMITED),
        "step_excerpt": lambda g: g.step_context(states[0], faults, UNLIMITED),
    }
