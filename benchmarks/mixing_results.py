"""Measure the Mixing Module and write ``docs/results/mixing_module.md``: ``python -m benchmarks.mixing_results``.

Runs that were measured before are read back from the cache folder, so an interrupted measurement goes on where it
stopped.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import platform
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.cstr_results import table
from homeostat.campaign.best_route import best_route
from homeostat.campaign.latest_fallback import latest_fallback
from homeostat.campaign.runner import build_plant, run
from homeostat.campaign.scenario import Scenario, scenario
from homeostat.cases.case import Case, load_case
from homeostat.cases.wiring import new_executive
from homeostat.domain.diagnosis import Fault, FaultState
from homeostat.plant.clock import DeclaredClock
from homeostat.trace import MemoryTrace
from homeostat.trace.decisions import Departed, StateEntered

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
VALVES = ("VI201", "VI202", "VI203", "VO201", "VO202", "VO203", "VI204", "VO204")
FAMILIES = PUBLISHED | {
    "stuck_valve": tuple(f"stuck_{way}_{valve}" for way in ("closed", "open") for valve in VALVES),
    "open_inlet": tuple(f"stuck_open_{valve}" for valve in VALVES[:3]),
}
"""What a single fault is drawn from; new families come last, so that the draws of the others stay."""
PAIR = "pair"
"""Two of the published five at once, each with its own place, severity and onset."""
PAIR_STREAM = 6
"""Random stream of the pairs."""
SEEDS = 20
END_S = 900.0
WHOLE = 0.9
"""A batch that gives less than this share of the fault-free product has given a part of it only [1]."""
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
def module() -> Case:
    """The Mixing Module, loaded once per process."""
    return load_case("mixing_module")


def drawn(family: str, seed: int) -> Scenario:
    """The scenario of one batch: place, severity and onset drawn for ``seed``."""
    case = module()
    if family == "none":
        return scenario(case, "none", seed, end_s=END_S)
    if family != PAIR:
        generator = np.random.default_rng([seed, list(FAMILIES).index(family)])
        return Scenario(case.name, (_fault(family, generator),), seed, END_S)
    generator = np.random.default_rng([seed, PAIR_STREAM])
    families = generator.choice(list(PUBLISHED), size=2, replace=False)
    return Scenario(case.name, tuple(_fault(str(f), generator) for f in families), seed, END_S)


def _fault(family: str, generator: np.random.Generator) -> FaultState:
    fault = module().description.fault(str(generator.choice(FAMILIES[family])))
    severity, onset = _severity(fault, generator), float(generator.uniform(5.0, BATCH_S))
    return FaultState(fault.name, severity, onset)


def _severity(fault: Fault, generator: np.random.Generator) -> float:
    r = fault.severity_range
    return round(float(generator.uniform(r.low, r.high)), 4)


def measure(job: tuple[str, int]) -> Row:
    """Run one batch, and find out what was possible."""
    family, seed = job
    case, chosen = module(), drawn(*job)
    trace = MemoryTrace()
    result = run(case, chosen, trace, DeclaredClock(1.0))
    states = [e.state for e in trace.of(StateEntered)]
    best = best_route(case, chosen)
    hard = {limit.name for limit in case.description.limits.hard}
    row = Row(
        family, chosen.fault, seed, tuple(f.severity for f in chosen.faults), tuple(f.onset_s for f in chosen.faults),
        result.outcome.value, result.actor, result.state, result.complete_s, result.nominal_s, dict(result.totals),
        max(e.total_s for e in result.exposures if e.limit in hard), result.detected_s, result.thinking_s,
        result.attempts, any(s.startswith("bypass") for s in states), best.complete_s if best else None,
        bool(best and any(s.startswith("bypass") for s in best.states)), None, len(trace.of(Departed)), result.wall_s,
    )  # fmt: skip
    return row if safe(row) else replace(row, latest_s=latest_fallback(case, chosen))


def measured(families: Sequence[str], seeds: int, workers: int | None) -> list[Row]:
    """Every batch, from the cache where it is there."""
    CACHE.mkdir(parents=True, exist_ok=True)
    file = CACHE / "batches.jsonl"
    rows = [Row(**json.loads(line)) for line in file.read_text().splitlines()] if file.exists() else []
    done = {(r.family, r.seed) for r in rows}
    jobs = [(f, s) for f in families for s in range(1, seeds + 1) if (f, s) not in done]
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool, file.open("a") as out:
        for row in pool.map(measure, jobs):
            rows.append(row)
            out.write(json.dumps(asdict(row)) + "\n")
            out.flush()
            print(row.fault, row.seed, _list(row.severity, "g"), _list(row.onset_s, ".0f"), row.outcome, row.actor,
                  row.state, row.complete_s, "possible" if row.best_s else "impossible", row.totals,
                  flush=True)  # fmt: skip
    return [r for r in rows if r.family in families and r.seed <= seeds]


def _latest(row: Row) -> str:
    """How late a fallback could have acted, for a batch that was not safe."""
    if safe(row):
        return ""
    return "none in time" if row.latest_s is None else f"{row.latest_s}"


def _list(numbers: Sequence[float], form: str) -> str:
    """One number per fault."""
    return " + ".join(format(number, form) for number in numbers)


def nominal_ms() -> float:
    """Time that one nominal batch takes on the simulated plant with its executive, best of five [ms]."""
    case, best = module(), float("inf")
    chosen = scenario(case, "none", 1, end_s=250.0)
    for _ in range(5):
        plant = build_plant(case, chosen, DeclaredClock(0.0), new_executive(case))

        async def watch() -> None:
            async for _ in plant.snapshots():  # noqa: B023
                pass

        begin = time.perf_counter()
        asyncio.run(watch())
        best = min(best, time.perf_counter() - begin)
    return 1000.0 * best


def safe(row: Row) -> bool:
    """Whether nothing overflowed, ran dry or worked against a closed line."""
    return max(row.totals[n] for n in ("overflowed_L", "dry_run_s", "dead_head_s")) <= 0.0 and row.outside_s == 0.0


def summary(rows: Sequence[Row]) -> str:
    """One line per family."""
    lines = []
    whole_L = WHOLE * median(r.totals["delivered_L"] for r in rows if r.family == "none")
    for family in dict.fromkeys(r.family for r in rows):
        mine = [r for r in rows if r.family == family]
        done = [r for r in mine if r.complete_s is not None]
        possible = [r for r in mine if r.best_s is not None]
        late = [r.complete_s - r.nominal_s for r in done if r.complete_s is not None and r.nominal_s is not None]
        thought = [r.thinking_s for r in mine if r.attempts]
        lines.append([
            family, f"{len(done)}/{len(mine)}", f"{sum(r.totals['delivered_L'] < whole_L for r in done)}",
            f"{sum(r.state == 'held' for r in mine)}",
            f"{sum(r.actor == 'fallback' for r in mine)}", f"{sum(safe(r) for r in mine)}/{len(mine)}",
            f"{sum(not safe(r) and r.latest_s is None for r in mine)}",
            f"{sum(r.complete_s is not None for r in possible)}/{len(possible)}",
            f"{sum(r.bypass for r in mine)}", f"{sum(r.best_bypass for r in mine)}",
            f"{median(late):.0f} ({max(late):.0f})" if late else "",
            f"{max(r.totals['spilled_L'] for r in mine):.2f}",
            f"{median(thought):.1f} ({max(thought):.1f})" if thought else "", f"{sum(r.departures for r in mine)}",
        ])  # fmt: skip
    head = [
        "fault", "complete", "with part of the product", "held", "fallback",
        "no overflow, dry run, dead head, hard limit", "beyond any fallback", "complete where possible",
        "by the bypass", "bypass best by hindsight", "later than nominal, median (max) [s]", "spilled, max [L]",
        "thinking, median (max) [s]", "departures from the prediction",
    ]  # fmt: skip
    return table(head, lines)


def odd(rows: Sequence[Row]) -> str:
    """Batches that were possible and not completed, or not safe."""
    found = [r for r in rows if not safe(r) or (r.best_s is not None and r.complete_s is None)]
    lines = [
        [r.fault, str(r.seed), _list(r.severity, "g"), _list(r.onset_s, ".0f"), r.state, r.actor,
         "" if r.best_s is None else f"{r.best_s:.0f}", _latest(r),
         ", ".join(f"{k} {v:.3g}" for k, v in r.totals.items() if v)]
        for r in found
    ]  # fmt: skip
    head = [
        "fault",
        "seed",
        "severity",
        "onset [s]",
        "ended in",
        "actor",
        "best complete [s]",
        "latest fallback [s after the onset]",
        "totals",
    ]
    return table(head, lines) if found else "None."


def main(arguments: list[str]) -> int:
    """Measure what is missing and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--workers", type=int, help="processes; one per core where it is left out")
    options = parser.parse_args(arguments)
    rows = measured(("none", *FAMILIES, PAIR), options.seeds, options.workers)
    text = (ROOT / "benchmarks" / "mixing_results.md").read_text(encoding="utf-8")
    page = text.format(
        seeds=options.seeds, python=platform.python_version(), nominal_ms=f"{nominal_ms():.1f}", summary=summary(rows),
        odd=odd(rows), whole=WHOLE,
    )  # fmt: skip
    PAGE.write_text(page, encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
