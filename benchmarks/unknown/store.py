"""What the study keeps on disk: recordings as arrays, judged looks as lines; a study that stopped goes on from them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.host import ROOT, changed, commit

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
    "benchmarks/unknown/recorder.py",
    "benchmarks/unknown/band.py",
    "benchmarks/unknown/harmless.py",
)
"""Sources that a recording follows from; twin and isolation are not among them."""
JUDGED_BY = ("src", "benchmarks/unknown/judging.py", "benchmarks/unknown/looks.py")
"""Sources that a statement follows from."""


@cache
def key(paths: tuple[str, ...]) -> str:
    """The last commit that touched ``paths``; where they were changed since, with a digest of how."""
    text = changed(*paths)
    last = commit(*paths).rstrip("+")
    return f"{last}+{hashlib.sha256(text.encode()).hexdigest()[:8]}" if text else last


def recordings() -> Path:
    """Folder of the recordings that the present sources make."""
    return FOLDER / f"recordings-{key(RECORDED_BY)}"


def judged() -> Path:
    """File of what the present sources say of them."""
    return FOLDER / f"judged-{key(JUDGED_BY)}.jsonl"


def operated() -> Path:
    """File of the runs with everything on that the present sources make."""
    return FOLDER / f"operated-{key(('src', 'benchmarks/unknown/operated.py'))}.jsonl"


def append(path: Path, row: Mapping[str, Any]) -> None:
    """Add a line to ``path``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")


def lines(path: Path) -> Iterator[dict[str, Any]]:
    """Every whole line of ``path``; a torn last one is left out."""
    if not path.exists():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            yield json.loads(line)
        except json.JSONDecodeError:
            continue
