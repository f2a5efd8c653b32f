"""Room and time of a history: ``python -m benchmarks.history [--tags N] [--hours H] [--folder DIR]``."""

from __future__ import annotations

import argparse
import resource
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.history.plant import SECOND_US, PlantReadings
from benchmarks.host import measured_on
from homeostat.history.embedded.layout import KINDS
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS, Span

START_US = 1_764_000_000_000_000
TREND = 5
"""Tags of a trend."""
TIMES = 7
"""Readings whose median is told."""


def appended(store: EmbeddedStore, plant: PlantReadings, hours: float) -> dict[str, float]:
    """Append that much as fast as it goes; what one second of data cost."""
    walls, began_cpu, spent_cpu = list[float](), 0.0, 0.0
    left = round(hours * 3600)
    while left:
        seconds = min(left, 600)
        batches = list(plant.hour(seconds))
        began_cpu = time.process_time()
        for batch in batches:
            began = time.perf_counter()
            store.append(batch)
            walls.append(time.perf_counter() - began)
        spent_cpu += time.process_time() - began_cpu
        left -= seconds
    began_cpu = time.process_time()
    store.close()
    spent_cpu += time.process_time() - began_cpu
    ms = np.percentile(walls, [50, 99, 100]) * 1e3
    return {"p50_ms": ms[0], "p99_ms": ms[1], "max_ms": ms[2], "cpu_ms": spent_cpu / len(walls) * 1e3}


def sizes(folder: Path, samples: int) -> dict[str, float]:
    """Bytes per sample of each kind of table."""
    return {kind: sum(p.stat().st_size for p in (folder / kind).glob("*")) / samples for kind in KINDS}


def taken(work: Callable[[], Any]) -> tuple[float, float]:
    """Milliseconds that ``work`` takes: the first time, and then."""
    found = list[float]()
    for _ in range(TIMES):
        began = time.perf_counter()
        work()
        found.append((time.perf_counter() - began) * 1e3)
    return found[0], median(found[1:])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tags", type=int, default=2000)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--folder", type=Path, help="keep the store here (default: a folder that is removed)")
    options = parser.parse_args()
    folder = options.folder or Path(tempfile.mkdtemp())
    plant = PlantReadings(options.tags, START_US)
    cost = appended(EmbeddedStore(folder), plant, options.hours)
    room = sizes(folder, samples := round(options.hours * 3600) * options.tags)
    print(f"{options.tags} tags at 1 Hz for {options.hours:g} h, {samples} samples")
    print(f"append of one second: {cost['p50_ms']:.2f} ms (p99 {cost['p99_ms']:.2f}, most {cost['max_ms']:.1f})")
    print(f"processor time of one second, with tables: {cost['cpu_ms']:.2f} ms")
    print(f"room: {sum(room.values()):.2f} byte per sample ({', '.join(f'{k} {v:.2f}' for k, v in room.items())})")
    print(f"most memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    history = EmbeddedHistory(folder)
    some = [plant.tags[k * options.tags // TREND] for k in range(TREND)]
    end = START_US + round(options.hours * 3600) * SECOND_US
    day, last_hour = Span(end - 86_400 * SECOND_US, end), Span(end - 3600 * SECOND_US, end)
    for name, work in (
        (f"{TREND} tags, a day, minutes", lambda: history.minutes(some, day)),
        (f"{TREND} tags, a day, every sample", lambda: history.read(some, day)),
        (f"{TREND} tags, the last hour, every sample", lambda: history.read(some, last_hour)),
        (f"{TREND} tags, last value", lambda: history.last(some)),
        ("1 tag, everything", lambda: history.read(some[:1], ALWAYS)),
    ):
        first, then = taken(work)
        print(f"{name}: {first:.0f} ms at first, then {then:.0f} ms")
    print(measured_on())
    if options.folder is None:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
