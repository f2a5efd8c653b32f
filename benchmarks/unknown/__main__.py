"""Measure what is said of unknown causes: ``python -m benchmarks.unknown``, resumable."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from benchmarks.arguments import MISMATCHES, names, numbers
from benchmarks.unknown.bars import Study
from benchmarks.unknown.causes import PLANTS
from benchmarks.unknown.jobs import LOOKED_AT, PARTS, Job, jobs
from benchmarks.unknown.judging import NO_LOOK, done, judge
from benchmarks.unknown.page import DOCS, write
from benchmarks.unknown.recorder import record_all
from benchmarks.unknown.running import operate, results
from benchmarks.unknown.tally import Look
from benchmarks.unknown.workers import plant_named
from homeostat.plants.plant import Plant
from homeostat.process.batch import use_threads

STEPS = ("record", "judge", "operate", "page")
"""Record runs with nobody acting, judge what is said of them, run them with everything on, write the page."""


def main() -> int:
    """Carry out what the command line asks for."""
    asked = _arguments()
    use_threads(1)
    wanted = {}
    for plant in map(plant_named, asked.plants):
        wanted[plant.name] = plant, list(jobs(plant, asked.parts, asked.causes, asked.seeds, asked.mismatch))
    of = {name for _, runs in wanted.values() for job in runs for name in (job.cause.id, job.cause.kind)}
    if wrong := [name for name in asked.causes if name not in of]:
        raise SystemExit(f"there is no cause {wrong[0]!r}; the tables have them: benchmarks/unknown/causes_*.toml")
    every = [job for _, runs in wanted.values() for job in runs]
    seen = [job for job in every if job.part in LOOKED_AT]
    if "record" in asked.steps:
        record_all(seen, asked.jobs)
    if "judge" in asked.steps:
        judge(seen, asked.looks, asked.fresh, asked.jobs)
    if "operate" in asked.steps:
        operate(every, asked.jobs)
    if "page" in asked.steps:
        write([_study(plant, runs, asked.fresh) for plant, runs in wanted.values()], asked.mismatch, Path(asked.out))
    return 0


def _study(plant: Plant, wanted: Sequence[Job], fresh: bool) -> Study:
    """What is in of one plant, in the order in which it was asked for: whoever ran what does not matter."""
    found = done(wanted, fresh)
    looks = [
        Look(job, found[job.name, after])
        for job in wanted
        for after in (NO_LOOK, *job.looks_s)
        if (job.name, after) in found
    ]
    return Study(plant, wanted, looks, list(results(wanted).values()))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.unknown", description=__doc__)
    parser.add_argument("steps", nargs="*", default=list(STEPS), metavar="STEP", help=", ".join(STEPS))
    parser.add_argument("--plants", type=names, default=list(PLANTS), help="cstr,mixing_module")
    parser.add_argument("--parts", type=names, default=list(PARTS), help=",".join(PARTS))
    parser.add_argument("--causes", type=names, default=[], help="ids or classes of causes; all by default")
    parser.add_argument("--seeds", type=numbers, default=[], help="as 1,2 or 1-3; the study's own by default")
    parser.add_argument("--looks", type=numbers, default=[], help="seconds after the first symptom; all by default")
    parser.add_argument("--fresh", action="store_true", help="every look forgets what was said before it")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes, each with one run at a time")
    parser.add_argument("--out", default=str(DOCS), help="folder of the page and its figure")
    parser.add_argument("--mismatch", default="plant", choices=MISMATCHES, help="how the true plant is not its model")
    asked = parser.parse_args()
    if asked.jobs < 1:
        parser.error(f"--jobs {asked.jobs} must be at least 1 process")
    for name, known, given in (
        ("step", STEPS, asked.steps),
        ("plant", PLANTS, asked.plants),
        ("part", PARTS, asked.parts),
    ):
        if wrong := [one for one in given if one not in known]:
            parser.error(f"there is no {name} {wrong[0]!r}; there are {', '.join(known)}")
    return asked


if __name__ == "__main__":
    raise SystemExit(main())
