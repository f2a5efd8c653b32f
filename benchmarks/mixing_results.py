"""Measure the Mixing Module and write ``docs/results/mixing_module.md``: ``python -m benchmarks.mixing_results``.

Runs that were measured before are read back from the cache folder, so an interrupted measurement goes on where it
stopped.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

from pyoxigraph import NamedNode

from benchmarks.host import kept, measured_on
from benchmarks.mixing_batches import FAMILIES, MISMATCH, PAIR, PUBLISHED, Row, measure, module
from benchmarks.mixing_calls import FAULTS, FOLDER, answers
from benchmarks.mixing_language import LanguageRow, StepRow, routes_table, step_by_step, steps_table, whole_routes
from benchmarks.mixing_replay import judged, replay_table
from benchmarks.mixing_tables import WHOLE, needless, odd, summary
from benchmarks.mixing_wrong_routes import wrong_routes
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import scenario
from homeostat.knowledge.checks.lint import lint
from homeostat.knowledge.questions.questions import transitions
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.graph_file import load_file
from homeostat.plants.wired.assembly import new_sequencer

T = TypeVar("T", Row, LanguageRow, StepRow)
Job = TypeVar("Job", tuple[str, int], tuple[str, int, bool])
ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results" / "mixing_module.md"
GRAPH = FOLDER.parent / "knowledge_graphs" / "mixer_case" / "MixingModuleKG_v2.jsonld"
SEEDS = 20
STEP_SEEDS = 10
"""Batches per fault in which every step is asked for."""


def measured(
    name: str, kind: type[T], measure_one: Callable[[Job], T], jobs: Sequence[Job], workers: int | None
) -> list[T]:
    """What ``measure_one`` makes of every job, in their order, from the cache file ``name`` where it is there."""
    folder = kept("mixing")
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{name}.jsonl"
    lines = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    rows = {json.dumps(job): kind(**row) for job, row in lines}
    missing = [job for job in jobs if json.dumps(job) not in rows]
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool, file.open("a") as out:
        for job, row in zip(missing, pool.map(measure_one, missing), strict=True):
            rows[json.dumps(job)] = row
            out.write(json.dumps([job, asdict(row)]) + "\n")
            out.flush()
            print(name, *job, *list(asdict(row).values())[1:12], flush=True)
    return [rows[json.dumps(job)] for job in jobs]


def nominal_ms() -> float:
    """Time that one nominal batch takes on the simulated plant with its sequencer, best of five [ms]."""
    plant, best = module(), float("inf")
    chosen = scenario(plant, "none", 1, end_s=250.0)
    for _ in range(5):
        process, recipe = open_process(plant, chosen), new_sequencer(plant).sample
        begin = time.perf_counter()
        watch(process, recipe)
        best = min(best, time.perf_counter() - begin)
    return 1000.0 * best


def published_graph() -> str:
    """What our question and our check say of the published graph, or that it is not there."""
    if not GRAPH.exists():
        return "Not there."
    store = EmbeddedStore()
    load_file(store, GRAPH)
    found = len(transitions(store, NamedNode("http://example.org/mixer#MixerStateMachine")))
    codes = Counter(b.code.value for b in lint(store))
    told = ", ".join(f"{n} {code}" for code, n in sorted(codes.items()))
    return f"{found} transitions; {sum(codes.values())} lint findings: {told}."


def replayed() -> str:
    """The table of the recorded answers, or that they are not there."""
    if not FOLDER.exists():
        return "Not there."
    return replay_table([(answer, count, judged(answer)) for answer, count in sorted(answers().items())])


def main(arguments: list[str]) -> int:
    """Measure what is missing and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--workers", type=int, help="processes; one per core where it is left out")
    options = parser.parse_args(arguments)
    seeds, workers = range(1, options.seeds + 1), options.workers
    drawn = [(family, seed) for family in ("none", *FAMILIES, PAIR) for seed in seeds]
    rows = measured("batches", Row, measure, drawn, workers)
    asked = [job for job in drawn if job[0] in ("none", *PUBLISHED)]
    routes = measured("language", LanguageRow, whole_routes, asked, workers)
    few = seeds[:STEP_SEEDS]
    steps = [(fault, seed, given) for fault in FAULTS for given in (True, False) for seed in few]
    text = (ROOT / "benchmarks" / "mixing_results.md").read_text(encoding="utf-8")
    page = text.format(
        seeds=options.seeds, mismatch=MISMATCH, measured=measured_on(), nominal_ms=f"{nominal_ms():.1f}",
        summary=summary(rows), odd=odd(rows), whole=WHOLE, needless=needless(rows), routes=routes_table(routes),
        step_seeds=len(few),
        steps=steps_table(measured("steps", StepRow, step_by_step, steps, workers)), wrong=wrong_routes(options.seeds),
        replay=replayed(), graph=published_graph(),
    )  # fmt: skip
    PAGE.write_text(page, encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
