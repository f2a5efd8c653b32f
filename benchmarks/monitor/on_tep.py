"""Tennessee Eastman: how much of each disturbance is detected, and how soon, at a measured rate of false alarms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.monitor.data import ONSET, STEP_MIN, faults, recording
from homeostat.detectors.alarms import LASTING
from homeostat.detectors.catalogue import detectors
from homeostat.detectors.learning import Baseline

SEED = 1


@dataclass(frozen=True)
class Detection:
    """What some detectors do at some rate of false alarms."""

    rates: dict[int, float]
    """Disturbance -> share of its rows beyond the limit [1]."""
    delays_min: dict[int, float]
    """Disturbance -> time from its onset to the first of six rows in a row beyond it [min]; infinite for never.

    It begins at the last row without it: the first one with it is one step late."""
    false_alarms: float
    """Share of the rows before the disturbances beyond it [1]: no limit was read from them."""

    @property
    def mean(self) -> float:
        """Mean of the rates [1]."""
        return float(np.mean(list(self.rates.values())))


def at_equal_rate(folder: Path, names: Sequence[str], rate: float) -> Detection:
    """Learned from the training rows; the limit is what ``rate`` of the fault-free test rows exceed."""
    trained, free = recording(folder, 0)
    baseline = Baseline.of([trained], detectors(names, SEED), rate)
    limit = float(np.quantile(baseline.judge(free).scores.max(axis=1), 1.0 - rate))
    return _detection(folder, baseline, limit)


def at_stated_rate(folder: Path, names: Sequence[str], rate: float) -> Detection:
    """As the command does: learned from all fault-free rows, at a stated rate."""
    return _detection(folder, Baseline.of(recording(folder, 0), detectors(names, SEED), rate), 1.0)


def _detection(folder: Path, baseline: Baseline, limit: float) -> Detection:
    rates, delays, early = {}, {}, []
    for number in faults(folder):
        over = baseline.judge(recording(folder, number)[1]).scores.max(axis=1) > limit
        early.append(over[:ONSET])
        rates[number] = float(over[ONSET:].mean())
        lasting = np.convolve(over[ONSET:], np.ones(LASTING), "valid") >= LASTING
        delays[number] = STEP_MIN * (1 + int(lasting.argmax())) if lasting.any() else np.inf
    return Detection(rates, delays, float(np.mean(early)))
