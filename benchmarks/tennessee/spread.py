"""How much outputs vary under a disturbance that nobody answers, ours and the published ones."""

from __future__ import annotations

import csv
from collections.abc import Mapping

import numpy as np

from benchmarks.tennessee.published import OUTPUTS, SETTLED_H, SPREAD
from homeostat.domain.snapshot import Trajectory


def spread(truth: Trajectory, onset_s: float) -> dict[str, float]:
    """Standard deviation of each output, in its unit, from :data:`SETTLED_H` after ``onset_s`` on."""
    settled = truth.times_s >= onset_s + 3600.0 * SETTLED_H
    return {name: float(np.std(truth.signals[name][0, settled])) for name in OUTPUTS}


def published_spread() -> dict[int, list[Mapping[str, float]]]:
    """Number of a disturbance, 0 for none -> the same of each run of the published code."""
    found: dict[int, list[Mapping[str, float]]] = {}
    with SPREAD.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            found.setdefault(int(row["idv"]), []).append({name: float(row[name]) for name in OUTPUTS})
    return found


def mean(runs: list[Mapping[str, float]]) -> dict[str, float]:
    """Of each output the root of its mean square over ``runs``."""
    return {name: float(np.sqrt(np.mean([run[name] ** 2 for run in runs]))) for name in OUTPUTS}
