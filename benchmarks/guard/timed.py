"""A guard whose decisions are timed, and the memory of the process that it runs in."""

from __future__ import annotations

import os
import time
from array import array
from pathlib import Path
from typing import Any

from benchmarks.guard.store import quantile
from homeostat.domain.observation import Observation
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Guard


class Timed:
    """Stands for a guard and measures each of its ticks, by the wall and by the CPU time of the thread that decides."""

    def __init__(self, guard: Guard) -> None:
        self._guard = guard
        self.wall_s, self.cpu_s = array("d"), array("d")

    def tick(self, now_s: float, sample: Snapshot | None) -> Observation:
        wall_s, cpu_s = time.perf_counter(), time.thread_time()
        seen = self._guard.tick(now_s, sample)
        self.cpu_s.append(time.thread_time() - cpu_s)
        self.wall_s.append(time.perf_counter() - wall_s)
        return seen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._guard, name)

    def summary(self) -> dict[str, float]:
        """Median and 99th percentile of a decision [ms]."""
        wall, cpu = list(self.wall_s), list(self.cpu_s)
        return {
            "ticks": len(wall), "median_ms": 1e3 * quantile(wall, 0.5), "p99_ms": 1e3 * quantile(wall, 0.99),
            "cpu_median_ms": 1e3 * quantile(cpu, 0.5), "cpu_p99_ms": 1e3 * quantile(cpu, 0.99),
        }  # fmt: skip


def rss_mb() -> float:
    """Resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


class Memory:
    """Resident memory every ten minutes of process time."""

    def __init__(self, every_s: float = 600.0) -> None:
        self._every_s = every_s
        self.samples: list[tuple[float, float]] = []

    def __call__(self, seen: Observation) -> None:
        if seen.now_s % self._every_s == 0.0:
            self.samples.append((seen.now_s, round(rss_mb(), 2)))

    def growth(self, from_s: float = 3600.0) -> float:
        """Growth of what is used from ``from_s`` [s] to the end [1]; NaN where the run is too short."""
        first = [mb for at_s, mb in self.samples if at_s == from_s]
        return self.samples[-1][1] / first[0] - 1.0 if first and self.samples[-1][0] > from_s else float("nan")
