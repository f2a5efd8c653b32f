"""Measure what is said of unknown causes: ``python -m benchmarks.unknown``, resumable."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

from benchmarks.unknown.causes import PLANTS
from benchmarks.unknown.jobs import PARTS, Job, jobs
from benchmarks.unknown.judging import judge
from benchmarks.unknown.recorder import load, path_of, record, save
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.batch import use_threads


def main() -> int:
    """Carry out what the command line asks for."""
    asked = _arguments()
    use_threads(1)
    for name in asked.plants:
        plant = load_plant(name)
        wanted = list(jobs(plant, asked.parts, asked.causes, asked.seeds, asked.mismatch))
        if "record" in asked.steps:
            _record(plant, wanted)
        if "judge" in asked.steps:
            judge(plant, wanted, asked.looks, asked.fresh)
    return 0


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
    parser.add_argument("steps", nargs="*", default=["record", "judge"], metavar="STEP", help="record or judge")
    parser.add_argument("--plants", type=_names, default=list(PLANTS), help="cstr,mixing_module")
    parser.add_argument("--parts", type=_names, default=list(PARTS), help=",".join(PARTS))
    parser.add_argument("--causes", type=_names, default=[], help="ids or classes of causes; all by default")
    parser.add_argument("--seeds", type=_numbers, default=[], help="as 1,2 or 1-3; the study's own by default")
    parser.add_argument("--looks", type=_numbers, default=[], help="seconds after the first symptom; all by default")
    parser.add_argument("--fresh", action="store_true", help="every look forgets what was said before it")
    parser.add_argument("--mismatch", default="plant", help="how the true plant is not its model")
    return parser.parse_args()


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
