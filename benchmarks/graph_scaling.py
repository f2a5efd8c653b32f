"""How long each query template takes on plants of growing size; the time should not depend on the size.

    python -m benchmarks.graph_scaling [--triples 10000 100000] [--repeat 20] [--on-disk FOLDER]

Prints the median time in milliseconds and the size of the answer, per template and plant.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from pyoxigraph import RdfFormat

from benchmarks.synthetic_plant import node, plant
from homeostat.knowledge.questions.query import Argument, Form, template
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.store import GraphStore


def questions(module: int) -> dict[str, dict[str, Argument]]:
    """Arguments for every template, about one module."""
    machine = node(module, "machine")
    faults = (node(module, "fault", 0), node(module, "fault", 1))
    step: dict[str, Argument] = {"source": node(module, "state", 3), "target": node(module, "state", 4)}
    return {
        "state_machine": {"machine": machine},
        "candidate_faults": {"symptoms": (node(module, "symptom", 0), node(module, "symptom", 5))},
        "is_admissible_step": {"machine": machine, "faults": faults, **step},
    }


def size_of_answer(store: GraphStore, name: str, arguments: dict[str, Argument]) -> int:
    """Number of rows or triples that a template yields; 0 or 1 for a truth value."""
    question = template(name)
    match question.form:
        case Form.SELECT:
            return len(question.select(store, **arguments))
        case Form.ASK:
            return int(question.ask(store, **arguments))
        case _:
            return len(question.construct(store, **arguments))


def median_ms(action: Callable[[], object], repeat: int) -> float:
    """Median duration of ``action`` in milliseconds, after one run that is not counted."""
    action()
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        action()
        times.append(1000 * (time.perf_counter() - start))
    return statistics.median(times)


def main() -> None:
    """Measure and print."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--triples", type=int, nargs="+", default=[10_000, 100_000], help="sizes of the plants")
    arguments.add_argument("--repeat", type=int, default=20, help="runs per template")
    arguments.add_argument("--on-disk", type=Path, help="folder for stores on disk; in memory without")
    chosen = arguments.parse_args()
    per_module = len(plant(2).splitlines()) - len(plant(1).splitlines())
    print(f"{'triples':>9}  {'template':<20} {'answer':>6} {'median ms':>10}")
    for triples in chosen.triples:
        modules = max(1, round(triples / per_module))
        store = EmbeddedStore(chosen.on_disk / str(triples) if chosen.on_disk else None)
        store.load(plant(modules), RdfFormat.N_TRIPLES)
        for name, bound in questions(modules // 2).items():
            took = median_ms(partial(size_of_answer, store, name, bound), chosen.repeat)
            print(f"{modules * per_module:>9}  {name:<20} {size_of_answer(store, name, bound):>6} {took:>10.2f}")


if __name__ == "__main__":
    main()
