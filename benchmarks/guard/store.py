"""Results on disk: a JSON file per part, with the commit of the sources that it was measured on and a yardstick."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.host import ROOT, host

SHM = Path("/dev/shm")
FAST = str(SHM) if SHM.is_dir() else None
"""Where a journal lies that a simulated day waits for: a second takes less than a millisecond there, and a disk that
hangs for a tenth of a second would hang for minutes of the plant's time."""
CACHE = ROOT / "runs" / "results" / "guard"


@dataclass(frozen=True)
class Sizes:
    """How much is measured."""

    trips: int = 200
    """Steps per base, size and limit."""
    quiet: int = 100
    """Fault-free runs near a limit."""
    days_s: float = 86_400.0
    """Length of the long runs [s]."""
    kills: int = 1000
    """Lives that are killed."""
    requests: int = 10_000
    """Requests per plant."""
    faults: int | None = None
    """Faults per plant that are recovered from; None for all."""
    repeats: int = 8
    """Seeds of the demo command, from 1 on."""
    mutants: int | None = None
    """Mutants of every group of modules; None for all."""


FULL = Sizes()
QUICK = Sizes(trips=5, quiet=3, days_s=7_200.0, kills=20, requests=200, faults=1, repeats=1, mutants=3)


def read(part: str, at: str) -> dict[str, Any] | None:
    """The results of ``part`` at commit ``at``; None where there are none."""
    path = CACHE / f"{part}-{at}.json"
    return json.loads(path.read_text()) if path.exists() else None


def newest(part: str) -> dict[str, Any] | None:
    """The results of ``part`` that were written last, of whatever commit."""
    paths = sorted(CACHE.glob(f"{part}-[0-9a-f]*.json"), key=lambda p: p.stat().st_mtime)
    return json.loads(paths[-1].read_text()) if paths else None


def write(part: str, at: str, result: dict[str, Any], wanted: dict[str, Any]) -> None:
    """Keep ``result``, with what was asked for, for the page and for a run that goes on later."""
    CACHE.mkdir(parents=True, exist_ok=True)
    path = CACHE / f"{part}-{at}.json"
    new = path.with_suffix(".new")
    new.write_text(json.dumps({"commit": at, "host": host(), "wanted": wanted, **result}, indent=1))
    new.replace(path)


def quantile(values: list[float], share: float) -> float:
    """The ``share`` quantile of ``values``, by the nearest rank; NaN of nothing."""
    ordered = sorted(values)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)] if ordered else float("nan")
