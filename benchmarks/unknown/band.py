"""How far features go by themselves: the band of fault-free runs, and when a run leaves it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.monitoring.features import FeatureFilter
from homeostat.domain.snapshot import Snapshot
from homeostat.plants.plant import Plant

SHARE = 0.999
"""Share of fault-free values that lies in the band [1]."""
OUTSIDE_S: Mapping[str, float] = {"cstr": 60.0}
"""Plant -> how long a feature must be outside without a break [s]; else as long as its rules wait."""


class Features:
    """Every feature of a run, second by second, from the plant's own mean where the plant learns one."""

    def __init__(self, plant: Plant, onset_s: float) -> None:
        """Values from ``onset_s`` [s] on count; the mean is learned before it."""
        self._filters = [FeatureFilter(f) for f in plant.description.features]
        self._onset_s = onset_s
        centre_s = plant.monitoring.centre_s
        self._centre_from_s = onset_s - centre_s if centre_s < onset_s else math.inf
        self._sums, self._counted = np.zeros(len(self._filters)), 0

    def update(self, snapshot: Snapshot) -> NDArray[np.float64] | None:
        """Deviations after one more snapshot, shape (features,), NaN where unknown; None before they count."""
        found = np.array([math.nan if (v := f.update(snapshot)) is None else v for f in self._filters])
        if snapshot.at_s < self._onset_s:
            if snapshot.at_s >= self._centre_from_s and np.isfinite(found).all():
                self._sums += found
                self._counted += 1
            return None
        return found - self._sums / max(self._counted, 1)


@dataclass(frozen=True, slots=True)
class Band:
    """Between what values features stay while nothing is wrong."""

    low: NDArray[np.float64]
    """Least deviation of each feature, in its unit."""
    high: NDArray[np.float64]
    """Largest one."""
    outside_s: NDArray[np.float64]
    """How long each must be outside to be noticed [s]."""

    @classmethod
    def of(cls, plant: Plant, runs: Sequence[NDArray[np.float64]]) -> Band:
        """The band of fault-free ``runs``, shapes (times, features)."""
        values = np.concatenate(runs)
        edges = np.nanquantile(values, [(1.0 - SHARE) / 2.0, (1.0 + SHARE) / 2.0], axis=0)
        waits = {f.name: 1.0 for f in plant.description.features}
        for rule in plant.description.symptom_rules:
            waits[rule.feature] = max(waits[rule.feature], rule.on_delay_s)
        outside = [OUTSIDE_S.get(plant.name, waits[f.name]) for f in plant.description.features]
        return cls(edges[0], edges[1], np.array(outside))


class Noticed:
    """Counts for how long each feature has been outside its band."""

    def __init__(self, band: Band) -> None:
        self._band = band
        self._for_s = np.zeros(band.low.size)
        self.found = np.zeros(band.low.size, dtype=np.bool_)
        """Which features were outside for long enough, shape (features,)."""

    def update(self, values: NDArray[np.float64]) -> None:
        """Take the deviations of one more second; an unknown one ends nothing and begins nothing."""
        outside = (values < self._band.low) | (values > self._band.high)
        self._for_s = np.where(np.isnan(values), self._for_s, np.where(outside, self._for_s + 1.0, 0.0))
        self.found |= self._for_s >= self._band.outside_s
