"""Decisions on a site: a fault in one module, its own supervisor, and all other modules running on around it."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

from benchmarks.scale.module_case import TimedStore, module_case
from benchmarks.scale.plant_graph import KINDS, kind_of
from benchmarks.scale.prompts import Declining, first_question, left_out, tokens
from benchmarks.scale.site import Site
from homeostat.agents.roles import Proposer
from homeostat.domain.events.recovery import Noticed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import scenario
from homeostat.evaluate.score.outcome import Facts, limits_of, outcome
from homeostat.evaluate.score.scoring import inside_at_end
from homeostat.journal import MemoryTrace
from homeostat.journal.events import Event
from homeostat.knowledge.store.store import GraphStore
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import SimulatedLink
from homeostat.llm.scripted import ScriptedModel
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Arrangement, Language, Workbench, wire
from homeostat.record.run_record import RunRecord

END_S = {"cstr": 2600.0, "mixing_module": 600.0}
"""Length of a run [s]."""
FAULTS = {
    "cstr": ("cool_stuck_closed", "pump_degrade", "inlet_stuck_open"),
    "mixing_module": ("pump_failure", "leakage_main", "sensor_stuck_B202"),
}
"""What goes wrong in the module that is looked at; onset and severity are the plant's."""


@dataclass(frozen=True)
class Decision:
    """One fault on a site."""

    modules: int
    """Size of the site."""
    module: int
    """Where the fault is."""
    kind: str
    """Plant of the module."""
    fault: str
    """What went wrong."""
    seed: int
    """What the module truly is."""
    outcome: str
    """How the run ended."""
    actor: str
    """Who acted first: ``search``, ``fallback`` or ``none``."""
    latency_s: float
    """Wall-clock time from detection to the first action, without the neighbours' simulation [s]; NaN for none."""
    cpu_s: float
    """Processor time of all threads for the same [s]; NaN for none."""
    planning_tokens: int
    """Tokens of the first planning question, role and rules included; 0 where none was asked."""
    action_tokens: int
    """Tokens of the first action question, likewise."""
    left_out: int
    """Things of the graph that did not fit into these two questions."""
    questions: int
    """Questions to the graph during the run."""
    question_median_ms: float
    """Their median time [ms]."""
    question_worst_ms: float
    """Their longest time [ms]."""
    neighbours_s: float
    """Wall-clock time of the neighbours' simulation [s]."""
    process_s: float
    """Process time that was simulated [s]."""

    @property
    def good(self) -> bool:
        """Whether the search found what was released, or the plant was rightly left alone."""
        return self.outcome in ("recovered", "no_action") and self.actor in ("search", "none")


class Stopwatch:
    """Follows a trace: how long the first action took since it was detected that something is wrong."""

    def __init__(self, site: Site) -> None:
        """The simulation of the neighbours in ``site`` is not thinking."""
        self._site = site
        self._wall_s, self._cpu_s = self._mark()
        self.latency_s = self.cpu_s = math.nan
        """Wall-clock time, and processor time of all threads [s]; NaN until something is done."""

    def __call__(self, event: Event, at_s: float) -> None:
        """Take one event."""
        if isinstance(event, Noticed):
            self._wall_s, self._cpu_s = self._mark()
        elif isinstance(event, ReleasedActions | FallbackActivated) and math.isnan(self.latency_s):
            wall_s, cpu_s = self._mark()
            self.latency_s, self.cpu_s = wall_s - self._wall_s, cpu_s - self._cpu_s

    def _mark(self) -> tuple[float, float]:
        return time.perf_counter() - self._site.spent_s, time.process_time() - self._site.spent_cpu_s


def _declining_first(bench: Workbench) -> tuple[Proposer, ...]:
    """The model before the search, so that it is asked however good the search's proposal is: its prompts count."""
    return (bench.speaking(), bench.searching())


def decide(
    cases: Mapping[str, Plant], store: GraphStore, modules: int, module: int, fault: str, seed: int,
    first: str = KINDS[0], end_s: float | None = None,
) -> Decision:  # fmt: skip
    """What comes of ``fault`` in ``module`` of a site of ``modules``; its other modules are what their numbers say.

    ``end_s``: length of the run [s]; that of its plant in :data:`END_S` where None.
    """
    kinds = [kind_of(k, first) for k in range(1, modules + 1)]
    seeds = [seed if k == module else 100_000 + k for k in range(1, modules + 1)]
    site, timed = Site(cases, kinds, seeds, module), TimedStore(store)
    plant = module_case(cases[kinds[module - 1]], timed, module)
    timed.took_ms.clear()
    chosen = scenario(plant, fault, seed, end_s=END_S[plant.name] if end_s is None else end_s)
    clock, trace = DeclaredClock(1.0), MemoryTrace()
    record, stopwatch = RunRecord(), Stopwatch(site)
    trace.subscribe(record)
    trace.subscribe(stopwatch)
    process = open_process(replace(plant, model=site.join(plant.model)), chosen)
    link = SimulatedLink(process)
    model = ScriptedModel("scripted:declining", Declining())
    arrangement = Arrangement(language=Language(model), propose=_declining_first)
    wire(plant, link, clock, trace, seed, arrangement).run(link.source)
    truth = process.truth()
    inside = inside_at_end(truth, limits_of(plant, record, truth))
    # On a site no alternative is tried: what was released is taken to be needed.
    kind = outcome(Facts(
        avoidable=False, inside_at_end=inside, fell_back=bool(record.fallbacks), missed=not record.diagnosed,
        released=bool(record.released), needless=False, produces=True,
    ))  # fmt: skip
    return Decision(
        modules, module, plant.name, fault, seed, kind.value, record.actor, stopwatch.latency_s, stopwatch.cpu_s,
        tokens(first_question(model, "planning")), tokens(first_question(model, "action")), left_out(model),
        len(timed.took_ms), timed.median_ms, max(timed.took_ms), site.spent_s, chosen.end_s,
    )  # fmt: skip
