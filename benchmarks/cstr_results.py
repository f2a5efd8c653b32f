"""Measure the reactor's recoveries and write ``docs/results/cstr.md``: ``make results``.

Every run has a declared thinking time of 1 s per deliberation, so that the figures do not depend on the machine; the
thinking and wall times are measured on their own, one run at a time.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache
from itertools import combinations
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.host import kept, measured_on
from homeostat.domain.outcome import Outcome
from homeostat.evaluate.reference.best_constant import best_constant
from homeostat.evaluate.reference.unsupervised import fault_free, unsupervised
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import departing, scenario
from homeostat.evaluate.score.costs import run_cost
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import exposures
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.plants.plant import Plant, load_plant

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results" / "cstr.md"
MISMATCH = "plant"
"""How the true plant is not the model that its twin has."""
MAIN = ("fouling", "pump_degrade", "cool_stuck_closed")
OTHER = ("cool_stuck_open", "outlet_block", "inlet_stuck_open", "temp_bias", "level_bias", "leak")
LIMITS = ("LIM-T-HIGH", "LIM-L-HIGH", "LIM-L-LOW", "LIM-T-LOW")
TEMPERATURES = tuple(float(t) for t in (*np.arange(300.0, 310.0, 2.0), *np.arange(310.0, 312.6, 0.5)))
FEEDS = (*(float(f) for f in np.arange(0.020, 0.0331, 0.0004)), 1.0 / 30.0)
GRID = {
    "fouling": {"T1.sp": TEMPERATURES, "L1.sp": (9.0, 10.0), "F1.sp": FEEDS},
    "cool_stuck_closed": {"T1.sp": TEMPERATURES, "L1.sp": (9.0, 10.0), "F1.sp": FEEDS},
    "pump_degrade": {"T1.sp": (308.0, 310.0, 312.0), "L1.sp": (8.0, 8.5, 9.0, 9.5, 10.0), "F1.sp": FEEDS},
}
MOVED = """## What moved since `170fbcd`, and why

- *Outcomes say what happened on the true plant.* Recovered: fed with a tenth of the design or more at the end, and
  leaving alone would have violated a hard limit or lost more. Most foulings harm nothing before 6000 s and a coolant
  valve that is stuck open harms nothing at all: acting on them is a needless action. Where the outlet stays blocked
  the plant is held: safe, without production. All of these were called recovered.
- *Every random number comes from a named child of the seed*, so a seed is another plant than it was.
- *A limit is watched on the reading and on the corrected reading.* A diagnosis lifts a trip only as far and as long as
  the tables allow and while another instrument carries the limit. Most pairs with `temp_bias`, whose thermometer reads
  above 313 K, end in the fallback therefore.
- *A request is verified on the next sample*, so a release comes one sample later.
- Where a pump run ends held, the first look at it leaves a share for a blocked outlet of the same size. Under that
  nothing but holding passes, and the way back is refused for its overshoot. Such an end was called recovered.
"""


@dataclass(frozen=True)
class Row:
    """One run, and the same plant without anybody acting."""

    fault: str
    seed: int
    outcome: str
    actor: str
    delay_s: float | None
    released_s: float | None
    attempts: int
    loss: float
    cost: float | None
    best_cost: float | None
    outside_s: dict[str, float]
    unsupervised_s: dict[str, float]
    top_k: float
    reason: str


@cache
def the_case() -> Plant:
    """The reactor, loaded once per process."""
    return load_plant("cstr")


def measure(job: tuple[str, int, bool]) -> Row:
    """Run one scenario; with the reference policy where asked for."""
    fault, seed, compared = job
    plant = the_case()
    s = departing(plant, scenario(plant, fault, seed), (), MISMATCH)
    result = run(plant, s, clock=DeclaredClock(1.0))
    alone = unsupervised(plant, s).truth
    started = 600.0
    idle = exposures(alone, LimitsInForce.after(plant.description, started), None)
    onset = s.onset_s or 0.0
    cost = best = None
    if compared and result.released_s is not None:
        healthy, states = fault_free(plant, s).truth, result.record.states
        own = run_cost(plant, result.truth, healthy, result.released_s, states, len(result.record.released))
        cost, best = own.share, best_constant(plant, s, result.released_s, GRID[fault]).cost / own.worth
    top = float(result.truth.signals["T1"][0, int(started) :].max())
    return Row(
        fault, seed, result.outcome.value, result.actor,
        None if result.detected_s is None else result.detected_s - onset, result.released_s, result.attempts,
        result.production_loss, cost, best, {e.limit: e.total_s for e in result.exposures},
        {e.limit: e.total_s for e in idle}, top, result.reason,
    )  # fmt: skip


def measure_all(name: str, jobs: Sequence[tuple[str, int, bool]], workers: int) -> list[Row]:
    """Rows of every job; those that were measured before are read back from the cache folder."""
    folder = kept("cstr")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.jsonl"
    done = {}
    if path.exists():
        for line in path.read_text().splitlines():
            row = Row(**json.loads(line))
            done[row.fault, row.seed] = row
    todo = [j for j in jobs if (j[0], j[1]) not in done]
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool, path.open("a") as file:
        for row in pool.map(measure, todo):
            done[row.fault, row.seed] = row
            file.write(json.dumps(asdict(row)) + "\n")
            file.flush()
            print(row.fault, row.seed, row.outcome, round(row.loss, 3), row.outside_s, row.reason, flush=True)
    return [done[f, s] for f, s, _ in jobs]


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(str(c) for c in r) + " |" for r in rows)])


def by_fault(rows: Sequence[Row], line: Callable[[str, list[Row]], Sequence[object]]) -> list[Sequence[object]]:
    """One table line per fault, in order of appearance."""
    names = dict.fromkeys(r.fault for r in rows)
    return [line(name, [r for r in rows if r.fault == name]) for name in names]


def main_line(name: str, rows: list[Row]) -> Sequence[object]:
    """Recovery of one of the three main faults."""
    delays = [r.delay_s for r in rows if r.delay_s is not None]
    hot = [r.outside_s["LIM-T-HIGH"] for r in rows]
    compared = [(r.cost, r.best_cost) for r in rows if r.cost is not None and r.best_cost is not None]
    excess = [100 * (cost - best) for cost, best in compared]
    return (
        name, f"{sum(r.outcome == 'recovered' for r in rows)}/{len(rows)}", f"{median(delays):.0f} ({max(delays):.0f})",
        f"{sum(h == 0 for h in hot)}/{len(rows)}", f"{max(hot):.0f}", f"{max(r.top_k for r in rows):.2f}",
        f"{100 * float(np.mean([r.loss for r in rows])):.1f}",
        f"{100 * float(np.mean([best for _, best in compared])):.1f}",
        f"{float(np.mean(excess)):.1f} ({max(excess):.1f})",
    )  # fmt: skip


def other_line(name: str, rows: list[Row]) -> Sequence[object]:
    """Outcomes of one fault or pair, and whether anything was worse than without action."""
    kinds = {kind: sum(r.outcome == kind for r in rows) for kind in Outcome}
    delays = [r.delay_s for r in rows if r.delay_s is not None]
    worse = sum(r.outside_s[x] > r.unsupervised_s[x] for r in rows for x in LIMITS)
    ours = max(sum(r.outside_s[x] for x in LIMITS) for r in rows)
    alone = max(sum(r.unsupervised_s[x] for x in LIMITS) for r in rows)
    delay = f"{median(delays):.0f}" if delays else "-"
    return (name, *kinds.values(), delay, f"{ours:.0f}", f"{alone:.0f}", worse)


def thinking() -> list[Sequence[object]]:
    """Thinking time until the first release, with the plant running on, one run at a time."""
    found = []
    plant = the_case()
    run(plant, scenario(plant, "cool_stuck_closed", 999, end_s=2100.0))
    for fault in MAIN:
        end_s = 6000.0 if fault == "fouling" else 2200.0
        times = [
            run(plant, scenario(plant, fault, s, end_s=end_s), clock=ThinkingClock()).thinking_s for s in range(1, 6)
        ]
        found.append((fault, f"{median(times):.2f}", f"{max(times):.2f}"))
    return found


def page(seeds: int, healthy: int, few: int, per_pair: int, workers: int) -> str:
    """The results page."""
    speed = thinking()
    main = measure_all("main", [(f, s, True) for f in MAIN for s in range(1, seeds + 1)], workers)
    other = measure_all("other", [(f, s, False) for f in OTHER for s in range(1, few + 1)], workers)
    names = ["+".join(p) for p in combinations((*MAIN, *OTHER), 2)]
    pairs = measure_all("pairs", [(n, s, False) for n in names for s in range(1, per_pair + 1)], workers)
    quiet = measure_all("healthy", [("none", s, False) for s in range(1, healthy + 1)], workers)
    alarms = sum(r.attempts > 0 or r.actor != "none" or r.delay_s is not None for r in quiet)
    engine = subprocess.run(
        [sys.executable, "-m", "benchmarks.engine"], capture_output=True, text=True, check=True, cwd=ROOT
    ).stdout
    columns = ("fault", *(kind.replace("_", " ") for kind in Outcome), "delay [s], median",
               "worst exposure [s]", "without action [s]", "limits exceeded longer than without action")  # fmt: skip
    return f"""# The reactor: what was measured

Made by `make results` ({seeds} seeds per main fault, {few} per other fault, {per_pair} per pair, {healthy} fault-free).
Each seed is another plant: its parameters, calibration errors and disturbances are drawn from the stated uncertainty.
Faults begin at 2000 s, runs end at 6000 s. One deliberation is charged 1 s of process time. The true plants are not the
twin's model: mismatch `{MISMATCH}`.

{measured_on()}

## Engine and accuracy

`python -m benchmarks.engine`:

```text
{engine.strip()}
```

## Recovery by search

Exposure is of the *true* temperature to 313 K, over the whole run. Loss is of production from the onset to the end. The
reference policy is the cheapest constant setpoint by the plant's prices, from the release on, that an exhaustive grid
(temperature, level, feed) finds *on the true plant*, with hindsight; costs are in points of the design production.

{
        table(
            (
                "fault",
                "recovered",
                "delay [s], median (max)",
                "0 s above 313 K",
                "longest above [s]",
                "hottest [K]",
                "loss [%]",
                "best constant [points]",
                "excess [points], mean (max)",
            ),
            by_fault(main, main_line),
        )
    }

## Thinking

Wall-clock seconds from the symptom to the first release, plant running on, one run at a time, 5 seeds.

{table(("fault", "median [s]", "max [s]"), speed)}

## Fault-free

{healthy} seeds of 6000 s: {alarms} runs in which anything reached planning.

## Other faults

Exposure sums the seconds outside all four limits (313 K, 11 L, 2 L while fed, 288 K).

{table(columns, by_fault(other, other_line))}

## Pairs of faults

{table(columns, by_fault(pairs, other_line))}

{MOVED}"""


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--healthy", type=int, default=100)
    parser.add_argument("--few", type=int, default=5)
    parser.add_argument("--per-pair", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    PAGE.parent.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(
        page(options.seeds, options.healthy, options.few, options.per_pair, options.workers), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
