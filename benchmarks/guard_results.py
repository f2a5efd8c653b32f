"""Measure the guard and write ``docs/results/guard.md``: ``python -m benchmarks.guard_results``.

Each part writes a file to ``runs/results/guard``, named by the last commit of the sources; a part that is there already
is not measured again. ``--part NAME`` measures one part, ``--quick`` measures little, ``--page`` only writes the page
from the newest file of every part.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from benchmarks.guard import asked, bad_day, cost, kills, mutation, quiet_day, trips, wire_log
from benchmarks.guard.page import PAGE, complete, page
from benchmarks.guard.store import FULL, QUICK, Sizes, read, write
from benchmarks.host import commit

PLANTS = ("cstr", "mixing_module")
Measure = Callable[[Sizes], dict[str, Any]]


def parts() -> dict[str, Measure]:
    """Every part by its name, in the order in which they are measured."""
    found: dict[str, Measure] = {"trips": trips.measure}
    for plant in PLANTS:
        found[f"quiet-{plant}"] = _of(quiet_day.measure, plant)
        found[f"bad-{plant}"] = _of(bad_day.measure, plant)
        found[f"kills-{plant}"] = _of(kills.measure, plant)
        found[f"asked-{plant}"] = _of(asked.measure, plant)
        found[f"wire-{plant}"] = _wire(plant)
    found["cost"] = cost.measure
    found["mutation"] = _mutation
    return found


def _of(measure: Callable[[str, Sizes], dict[str, Any]], plant: str) -> Measure:
    return lambda sizes: measure(plant, sizes)


def _wire(plant: str) -> Measure:
    """Every fault of ``plant``, each kept as soon as it is measured."""

    def measure(sizes: Sizes) -> dict[str, Any]:
        at, names = commit(), wire_log.faults(wire_log.load_plant(plant), sizes)
        name = f"wire-{plant}-runs" if sizes == FULL else f"wire-{plant}-runs-quick"
        done = (read(name, at) or {"runs": []})["runs"]
        for fault in names:
            if fault not in {r["fault"] for r in done}:
                done.append(wire_log.measure(plant, fault))
                write(name, at, {"runs": done}, asdict(sizes))
        return {"plant": plant, "wanted_faults": len(names), "runs": done}

    return measure


def _mutation(sizes: Sizes) -> dict[str, Any]:
    """Every module of the guard and those of recovery's loop, some at a time, each kept as soon as it is measured."""
    at, groups = commit(), mutation.groups()
    modules = sum(len(names) for _, names in groups)
    rows = (read("mutation", at) or {"rows": []})["rows"] if sizes == FULL else []
    for area, names in groups:
        missing = mutation.missing(area, names, {r["module"] for r in rows})
        if missing:
            rows += mutation.measure((area, missing), sizes)
            if sizes == FULL:
                write("mutation", at, {"modules": modules, "rows": rows}, asdict(sizes))
    return {"modules": modules, "rows": rows}


def main() -> None:
    """Measure what is missing and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", action="append", choices=list(parts()))
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--page", action="store_true")
    options = parser.parse_args()
    sizes, at = QUICK if options.quick else FULL, commit()
    for name, measure in parts().items():
        wanted = not options.page and (options.part is None or name in options.part)
        found = None if options.quick else read(name, at)
        if wanted and (found is None or complete(name, found) != "yes"):
            began = time.monotonic()
            result = measure(sizes)
            print(f"{name}: {time.monotonic() - began:.0f} s", flush=True)
            if not options.quick:
                write(name, at, result, asdict(sizes))
    if not options.quick:
        PAGE.parent.mkdir(exist_ok=True)
        PAGE.write_text(page(list(parts())), encoding="utf-8")


if __name__ == "__main__":
    main()
