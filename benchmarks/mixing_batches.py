"""Batches of the Mixing Module with random faults: what is drawn, and what is measured of one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from benchmarks.latest_fallback import latest_fallback
from homeostat.domain.diagnosis import FaultMode, FaultState
from homeostat.domain.events.deviations import Deviated
from homeostat.domain.events.guard import StateEntered
from homeostat.evaluate.reference.best_route import best_route
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Scenario, departing, scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.seeds import generator as draws

PUBLISHED = {
    "pump_failure": ("pump_failure",),
    "pump_degradation": ("pump_degradation",),
    "clogging": ("clogging_main", "clogging_B201", "clogging_B202", "clogging_B203", "clogging_common"),
    "leakage": ("leakage_main", "leakage_common"),
    "sensor_fault": tuple(
        f"sensor_{kind}_{place}"
        for kind in ("bias", "drift", "stuck")
        for place in ("flow", "B201", "B202", "B203", "B204")
        if (kind, place) != ("drift", "flow")
    ),
}
"""The five published faults, each with the places and kinds that it may have here."""
VALVES = ("VI201", "VI202", "VI203", "VO201", "VO202", "VO203", "VI204", "VO204")
FAMILIES = PUBLISHED | {
    "stuck_valve": tuple(f"stuck_{way}_{valve}" for way in ("closed", "open") for valve in VALVES),
    "open_inlet": tuple(f"stuck_open_{valve}" for valve in VALVES[:3]),
}
"""What a single fault is drawn from."""
PAIR = "pair"
"""Two of the published five at once, each with its own place, severity and onset."""
MISMATCH = "plant"
"""How the true plant is not the model that its twin has."""
END_S = 900.0
BATCH_S = 230.0
"""Onsets are drawn from the whole nominal batch [s]."""


@dataclass(frozen=True)
class Row:
    """One batch."""

    family: str
    fault: str
    seed: int
    severity: tuple[float, ...]
    onset_s: tuple[float, ...]
    outcome: str
    actor: str
    state: str
    complete_s: float | None
    nominal_s: float | None
    totals: dict[str, float]
    outside_s: float
    detected_s: float | None
    thinking_s: float
    attempts: int
    bypass: bool
    best_s: float | None
    best_bypass: bool
    latest_s: int | None
    departures: int
    wall_s: float


@cache
def module() -> Plant:
    """The Mixing Module, loaded once per process."""
    return load_plant("mixing_module")


def on_true_plant(chosen: Scenario) -> Scenario:
    """``chosen`` on a true plant that is not the twin's model."""
    return departing(module(), chosen, (), MISMATCH)


def drawn(family: str, seed: int) -> Scenario:
    """The scenario of one batch on its true plant: place, severity and onset drawn for ``seed``."""
    return on_true_plant(_drawn(family, seed))


def _drawn(family: str, seed: int) -> Scenario:
    plant = module()
    if family == "none":
        return scenario(plant, "none", seed, end_s=END_S)
    if family != PAIR:
        generator = draws(seed, "study/mixing batches", family)
        return Scenario(plant.name, (_fault(family, generator),), seed, END_S)
    generator = draws(seed, "study/mixing batches", PAIR)
    families = generator.choice(list(PUBLISHED), size=2, replace=False)
    return Scenario(plant.name, tuple(_fault(str(f), generator) for f in families), seed, END_S)


def _fault(family: str, generator: np.random.Generator) -> FaultState:
    fault = module().description.fault(str(generator.choice(FAMILIES[family])))
    severity, onset = _severity(fault, generator), float(generator.uniform(5.0, BATCH_S))
    return FaultState(fault.name, severity, onset)


def _severity(fault: FaultMode, generator: np.random.Generator) -> float:
    r = fault.severity_range
    return round(float(generator.uniform(r.low, r.high)), 4)


def measure(job: tuple[str, int]) -> Row:
    """Run one batch, and find out what was possible."""
    family, seed = job
    plant, chosen = module(), drawn(*job)
    trace = MemoryTrace()
    result = run(plant, chosen, trace, DeclaredClock(1.0))
    states = [e.state for e in trace.of(StateEntered)]
    best = best_route(plant, chosen)
    hard = {limit.name for limit in plant.description.limits.hard}
    row = Row(
        family, chosen.fault, seed, tuple(f.severity for f in chosen.faults), tuple(f.onset_s for f in chosen.faults),
        result.outcome.value, result.actor, result.state, result.complete_s, result.nominal_s, dict(result.totals),
        max(e.total_s for e in result.exposures if e.limit in hard), result.detected_s, result.thinking_s,
        result.attempts, any(s.startswith("bypass") for s in states), best.complete_s if best else None,
        bool(best and any(s.startswith("bypass") for s in best.states)), None, len(trace.of(Deviated)), result.wall_s,
    )  # fmt: skip
    return row if safe(row) else replace(row, latest_s=latest_fallback(plant, chosen))


def safe(row: Row) -> bool:
    """Whether nothing overflowed, ran dry or worked against a closed line."""
    return max(row.totals[n] for n in ("overflowed_L", "dry_run_s", "dead_head_s")) <= 0.0 and row.outside_s == 0.0
