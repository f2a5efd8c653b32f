"""Room and time of a history: ``python -m benchmarks.history [--tags N] [--hours H] [--folder DIR]``."""

from __future__ import annotations

import argparse
import resource
import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.history.plant import SECOND_US, PlantReadings
from benchmarks.host import measured_on
from homeostat.history.embedded.layout import KINDS, MARK
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


def taken(work: Callable[[], Any]) -> str:
    """What ``work`` takes on the wall clock and of the processor, the first time and then."""
    walls, cpus = list[float](), list[float]()
    for _ in range(TIMES):
        began, began_cpu = time.perf_counter(), time.process_time()
        work()
        walls.append((time.perf_counter() - began) * 1e3)
        cpus.append((time.process_time() - began_cpu) * 1e3)
    then = f"then {median(walls[1:]):.0f} ms ({median(cpus[1:]):.0f} ms)"
    return f"at first {walls[0]:.0f} ms ({cpus[0]:.0f} ms of the processor), {then}"


def written(folder: Path, plant: PlantReadings, hours: float) -> None:
    """Fill the store, and print what it cost."""
    tags = len(plant.tags)
    cost = appended(EmbeddedStore(folder), plant, hours)
    room = sizes(folder, samples := round(hours * 3600) * tags)
    print(f"{tags} tags at 1 Hz for {hours:g} h, {samples} samples")
    print(f"append of one second: {cost['p50_ms']:.2f} ms (p99 {cost['p99_ms']:.2f}, most {cost['max_ms']:.1f})")
    print(f"processor time of one second, with tables: {cost['cpu_ms']:.2f} ms")
    print(f"room: {sum(room.values()):.2f} byte per sample ({', '.join(f'{k} {v:.2f}' for k, v in room.items())})")
    print(f"most memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


def read(history: EmbeddedHistory, tags: Sequence[str], end_us: int) -> None:
    """Read what people look at, and print what it takes; ``end_us``: the latest time in the store [us]."""
    some = [tags[k * len(tags) // TREND] for k in range(TREND)]
    day, hour = (Span(end_us - seconds * SECOND_US, end_us) for seconds in (86_400, 3600))
    for name, work in (
        (f"{TREND} tags, a day, minutes", lambda: history.minutes(some, day)),
        (f"{TREND} tags, a day, every sample", lambda: history.read(some, day)),
        (f"{TREND} tags, the last hour, every sample", lambda: history.read(some, hour)),
        (f"{TREND} tags, last value", lambda: history.last(some)),
        ("1 tag, everything", lambda: history.read(some[:1], ALWAYS)),
    ):
        print(f"{name}: {taken(work)}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tags", type=int, default=2000)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--folder", type=Path, help="keep the store here (default: a folder that is removed)")
    options = parser.parse_args()
    folder = options.folder or Path(tempfile.mkdtemp())
    plant = PlantReadings(options.tags, START_US)
    if not (folder / MARK).exists():  # else one that was kept is read again
        written(folder, plant, options.hours)
    read(EmbeddedHistory(folder), plant.tags, START_US + round(options.hours * 3600) * SECOND_US)
    print(measured_on())
    if options.folder is None:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
