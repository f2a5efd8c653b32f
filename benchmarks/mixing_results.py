"""Measure the Mixing Module and write ``docs/results/mixing_module.md``: ``python -m benchmarks.mixing_results``.

Runs that were measured before are read back from the cache folder, so an interrupted measurement goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import platform
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.cstr_results import table
from homeostat.campaign.best_route import best_route
from homeostat.campaign.runner import run
from homeostat.campaign.scenario import Scenario, scenario
from homeostat.cases.case import Case, load_case
from homeostat.cases.wiring import new_executive
from homeostat.domain.diagnosis import Fault
from homeostat.plant.clock import DeclaredClock
from homeostat.process.batch import Batch
from homeostat.process.sequence import run_sequences
from homeostat.twin.twin import Twin

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results" / "mixing_module.md"
CACHE = Path("runs") / "mixing"
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
SEEDS = 20
END_S = 900.0
BATCH_S = 230.0
"""Onsets are drawn from the whole nominal batch [s]."""


@dataclass(frozen=True)
class Row:
    """One batch."""

    family: str
    fault: str
    seed: int
    severity: float
    onset_s: float
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
    wall_s: float


@cache
def module() -> Case:
    """The Mixing Module, loaded once per process."""
    return load_case("mixing_module")


def drawn(family: str, seed: int) -> Scenario:
    """The scenario of one batch: place, severity and onset drawn for ``seed``."""
    case = module()
    if family == "none":
        return scenario(case, "none", seed, end_s=END_S)
    generator = np.random.default_rng([seed, list(PUBLISHED).index(family)])
    fault = case.description.fault(str(generator.choice(PUBLISHED[family])))
    severity, onset = _severity(fault, generator), float(generator.uniform(5.0, BATCH_S))
    return scenario(case, fault.name, seed, onset, severity, END_S)


def _severity(fault: Fault, generator: np.random.Generator) -> float:
    r = fault.severity_range
    return round(float(generator.uniform(r.low, r.high)), 4)


def measure(job: tuple[str, int]) -> Row:
    """Run one batch, and find out what was possible."""
    family, seed = job
    case, chosen = module(), drawn(*job)
    states: list[str] = []
    result = run(case, chosen, clock=DeclaredClock(1.0), on_state=states.append)
    best = best_route(case, chosen)
    fault = chosen.faults[0] if chosen.faults else None
    hard = {limit.name for limit in case.description.limits.hard}
    return Row(
        family, chosen.fault, seed, fault.severity if fault else 0.0, fault.onset_s if fault else 0.0,
        result.outcome.value, result.actor, result.state, result.complete_s, result.nominal_s, dict(result.totals),
        max(e.total_s for e in result.exposures if e.limit in hard), result.detected_s, result.thinking_s,
        result.attempts, any(s.startswith("bypass") for s in states), best.complete_s if best else None,
        bool(best and any(s.startswith("bypass") for s in best.states)), result.wall_s,
    )  # fmt: skip
