"""SKAB by its own scoring: rows after the first 400 of every file, counted together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.monitor.data import HEALTHY, Experiment
from homeostat.detectors.tables.table import SignalTable
from homeostat.detectors.watching import Watching, watch


@dataclass(frozen=True)
class Score:
    """What the benchmark's table of outlier detection states."""

    hits: int
    false_alarms: int
    misses: int
    rejections: int

    @property
    def f1(self) -> float:
        """F1 [1]."""
        return 2.0 * self.hits / max(2 * self.hits + self.false_alarms + self.misses, 1)

    @property
    def far(self) -> float:
        """False alarms per normal row [1]."""
        return self.false_alarms / max(self.false_alarms + self.rejections, 1)

    @property
    def mar(self) -> float:
        """Misses per labelled row [1]."""
        return self.misses / max(self.misses + self.hits, 1)


def found(
    experiments: Sequence[Experiment], free: SignalTable, detectors: tuple[str, ...], stated: float
) -> dict[str, np.ndarray]:
    """Experiment -> which of its rows are beyond the limit, by the anomaly-free recording and all first rows."""
    how = Watching(detectors, stated, HEALTHY)
    courses = watch([e.table for e in experiments], [free], how)
    return {e.name: course.over for e, course in zip(experiments, courses, strict=True)}


def score(experiments: Sequence[Experiment], over: dict[str, np.ndarray]) -> Score:
    """The score of all ``experiments`` together."""
    said = np.concatenate([over[e.name][HEALTHY:] for e in experiments])
    true = np.concatenate([e.anomalous[HEALTHY:] for e in experiments])
    counts = (said & true, said & ~true, ~said & true, ~said & ~true)
    return Score(*(int(rows.sum()) for rows in counts))
