"""What the study keeps on disk: recordings as arrays, all else as lines; a study that stopped goes on from them."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO

from benchmarks.host import ROOT, changed, commit, run_sources
from benchmarks.unknown.jobs import Job

FOLDER = ROOT / "build" / "unknown"
RECORDED_BY = (
    "src/homeostat/agents/monitoring",
    "src/homeostat/domain",
    "src/homeostat/evaluate/reference/unsupervised.py",
    "src/homeostat/evaluate/scenario.py",
    "src/homeostat/evaluate/score",
    "src/homeostat/guard/sequence",
    "src/homeostat/guard/watch",
    "src/homeostat/links",
    "src/homeostat/plants",
    "src/homeostat/process",
    "src/homeostat/stl",
    "src/homeostat/twin/history.py",
    "src/homeostat/twin/isolation/prechecks.py",
    "benchmarks/unknown/recorder.py",
    "benchmarks/unknown/band.py",
    "benchmarks/unknown/harmless.py",
)
"""Sources that a recording follows from; of twin and isolation only what says which lines are flat."""
JUDGED, OPERATED, PAIRED, FORCED = "judged", "operated", "pairs", "forced"
_LOOKED_AT = tuple(f"benchmarks/unknown/{name}.py" for name in ("band", "causes", "harmless", "looks", "recorder"))
_RUN = run_sources()
FOLLOWS_FROM: Mapping[str, tuple[str, ...]] = {
    JUDGED: (*_RUN, *_LOOKED_AT, "benchmarks/unknown/judging.py"),
    OPERATED: (*_RUN, "benchmarks/unknown/judge.py", "benchmarks/unknown/looks.py", "benchmarks/unknown/operated.py"),
    PAIRED: (*_RUN, "benchmarks/unknown/pairs.py", "benchmarks/unknown/strategies.py"),
    FORCED: (*_RUN, "benchmarks/unknown/forced.py"),
}
"""What is kept as lines -> sources that it follows from."""


@cache
def key(paths: tuple[str, ...]) -> str:
    """The last commit that touched ``paths``; where they were changed since, with a digest of how."""
    text = changed(*paths)
    last = commit(*paths).rstrip("+")
    return f"{last}+{hashlib.sha256(text.encode()).hexdigest()[:8]}" if text else last


def recordings() -> Path:
    """Folder of the recordings that the present sources make."""
    return FOLDER / f"recordings-{key(RECORDED_BY)}"


def path_of(kind: str) -> Path:
    """File of the lines of one kind that the present sources make."""
    return FOLDER / f"{kind}-{key(FOLLOWS_FROM[kind])}.jsonl"


def keep(kind: str, job: Job, row: Mapping[str, Any]) -> None:
    """Add what was found of ``job``, with the truth that it was found of."""
    append(path_of(kind), {**row, "truth": job.truth})


def kept(kind: str, jobs: Iterable[Job]) -> Iterator[tuple[Job, dict[str, Any]]]:
    """Every line of one kind about one of ``jobs``, but for those of another truth under the same name.

    Lists are tuples again, as whoever kept them had them.
    """
    named = {job.name: job for job in jobs}
    for row in lines(path_of(kind)):
        job = named.get(row["run"])
        if job is not None and row.pop("truth") == job.truth:
            yield job, {name: tuple(value) if isinstance(value, list) else value for name, value in row.items()}


def append(path: Path, row: Mapping[str, Any]) -> None:
    """Add a line to ``path``, on a line of its own where the last one is torn."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+b") as file:
        torn = file.tell() > 0 and _last(file) != b"\n"
        file.write((b"\n" if torn else b"") + json.dumps(row).encode() + b"\n")


def _last(file: BinaryIO) -> bytes:
    file.seek(-1, 2)
    return file.read(1)


def lines(path: Path) -> Iterator[dict[str, Any]]:
    """Every whole line of ``path``; a torn one is left out."""
    if not path.exists():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            yield json.loads(line)
        except json.JSONDecodeError:
            continue


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A path to write to; what was written is at ``path`` afterwards, whole, whoever else writes the same."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(f"{os.getpid()}-{path.name}")
    yield new
    new.replace(path)
