"""Measure what is said of unknown causes: ``python -m benchmarks.unknown``, resumable."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.unknown.bars import Study
from benchmarks.unknown.causes import PLANTS
from benchmarks.unknown.jobs import DAY, OPERATED, PARTS, Job, jobs
from benchmarks.unknown.judging import done, judge
from benchmarks.unknown.operated import operate, results
from benchmarks.unknown.page import DOCS, write
from benchmarks.unknown.recorder import load, path_of, record, save
from benchmarks.unknown.tally import Look
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.batch import use_threads

STEPS = ("record", "judge", "operate", "page")
"""Record runs with nobody acting, judge what is said of them, run them with everything on, write the page."""


def main() -> int:
    """Carry out what the command line asks for."""
    asked = _arguments()
    use_threads(1)
    wanted = {}
    for plant in map(load_plant, asked.plants):
        wanted[plant.name] = plant, list(jobs(plant, asked.parts, asked.causes, asked.seeds, asked.mismatch))
    of = {name for _, runs in wanted.values() for job in runs for name in (job.cause.id, job.cause.kind)}
    if wrong := [name for name in asked.causes if name not in of]:
        raise SystemExit(f"there is no cause {wrong[0]!r}; the tables have them: benchmarks/unknown/causes_*.toml")
    for plant, runs in wanted.values():
        if "record" in asked.steps:
            _record(plant, [job for job in runs if job.part != DAY])
        if "judge" in asked.steps:
            judge(plant, [job for job in runs if job.part != DAY], asked.looks, asked.fresh)
        if "operate" in asked.steps:
            operate(plant, [job for job in runs if job.part in OPERATED])
    if "page" in asked.steps:
        write([_study(plant, runs, asked.fresh) for plant, runs in wanted.values()], asked.mismatch, Path(asked.out))
    return 0


def _study(plant: Plant, wanted: Sequence[Job], fresh: bool) -> Study:
    named = {job.name: job for job in wanted}
    looks = [Look(named[run], x) for (run, _), x in done(fresh).items() if run in named]
    return Study(plant, wanted, looks, [one for one in results() if one.run in named])


def _record(plant: Plant, wanted: Sequence[Job]) -> None:
    for job in wanted:
        path, began = path_of(job), time.process_time()
        if path.exists():
            continue
        save(record(plant, job), path)
        seen = load(path)
        print(
            f"{job.name}: first {seen.first_s:g} s, {len(seen.looks_s)} looks, {' '.join(seen.rules)}; "
            f"noticeable by {' '.join(seen.noticed) or 'nothing'}; {time.process_time() - began:.1f} s",
            flush=True,
        )


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.unknown", description=__doc__)
    parser.add_argument("steps", nargs="*", default=list(STEPS), metavar="STEP", help=", ".join(STEPS))
    parser.add_argument("--plants", type=_names, default=list(PLANTS), help="cstr,mixing_module")
    parser.add_argument("--parts", type=_names, default=list(PARTS), help=",".join(PARTS))
    parser.add_argument("--causes", type=_names, default=[], help="ids or classes of causes; all by default")
    parser.add_argument("--seeds", type=_numbers, default=[], help="as 1,2 or 1-3; the study's own by default")
    parser.add_argument("--looks", type=_numbers, default=[], help="seconds after the first symptom; all by default")
    parser.add_argument("--fresh", action="store_true", help="every look forgets what was said before it")
    parser.add_argument("--out", default=str(DOCS), help="folder of the page and its figure")
    parser.add_argument("--mismatch", default="plant", help="how the true plant is not its model")
    asked = parser.parse_args()
    for name, known, given in (
        ("step", STEPS, asked.steps),
        ("plant", PLANTS, asked.plants),
        ("part", PARTS, asked.parts),
    ):
        if wrong := [one for one in given if one not in known]:
            parser.error(f"there is no {name} {wrong[0]!r}; there are {', '.join(known)}")
    return asked


def _names(text: str) -> list[str]:
    return [name for name in text.split(",") if name]


def _numbers(text: str) -> list[int]:
    found: list[int] = []
    for part in _names(text):
        first, _, last = part.partition("-")
        found += range(int(first), int(last or first) + 1)
    return found


if __name__ == "__main__":
    raise SystemExit(main())
