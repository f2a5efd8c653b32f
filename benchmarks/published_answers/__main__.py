"""Convert records of the published studies to files of calls: ``python -m benchmarks.published_answers --help``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.mixing_calls import FOLDER
from benchmarks.published_answers.mixing import mixing_runs
from benchmarks.published_answers.reactor import reactor_runs
from benchmarks.published_answers.runs import PublishedRun

RUNS = 10
"""Runs of each fault in a published study."""


def converted(records: Path, as_said: bool = False) -> list[PublishedRun]:
    """Every run in the records; FileNotFoundError where there is none."""
    found = [*mixing_runs(records), *reactor_runs(records, as_said)]
    if not found:
        raise FileNotFoundError(f"{str(records)!r} has none of the recorded studies; give their folder")
    return found


def write(runs: Sequence[PublishedRun], out: Path) -> list[Path]:
    """Write the complete runs; their paths. ValueError where two would have the same file."""
    complete = [run for run in runs if run.complete]
    paths = [out / run.path for run in complete]
    if twice := {str(path) for path in paths if paths.count(path) > 1}:
        raise ValueError(f"two runs would be {min(twice)!r}; convert their records into different folders")
    for run, path in zip(complete, paths, strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("".join(f"{call.to_json()}\n" for call in run.calls), encoding="utf-8")
    return paths


def summary(runs: Sequence[PublishedRun]) -> str:
    """How many of which runs are there, one line per study, model and fault."""
    told = []
    for key in dict.fromkeys((r.campaign, r.model, r.case, r.scenario) for r in runs):
        mine = [r for r in runs if (r.campaign, r.model, r.case, r.scenario) == key]
        complete = sum(r.complete for r in mine)
        torn = f", {len(mine) - complete} with answers missing left out" if complete < len(mine) else ""
        told.append(f"{'/'.join(key[:2])}/{'-'.join(key[2:])}: {complete} of {RUNS} runs{torn}")
    return "\n".join(told)


def main(arguments: Sequence[str] | None = None) -> int:
    """Convert, and say what was there."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.published_answers")
    parser.add_argument("--records", type=Path, default=FOLDER, help="folder with the recorded studies")
    parser.add_argument("--out", type=Path, required=True, help="folder for the files of calls")
    parser.add_argument("--as-said", action="store_true", help="keep setpoints that are no whole increments")
    given = parser.parse_args(arguments)
    try:
        runs = converted(given.records, given.as_said)
        write(runs, given.out)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    print(summary(runs))
    return 0


if __name__ == "__main__":
    sys.exit(main())
