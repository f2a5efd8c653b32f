"""What the plant says: readings at one moment, and trajectories over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


class Quality(StrEnum):
    """How far a reading can be trusted (OPC UA severity classes)."""

    GOOD = "good"
    UNCERTAIN = "uncertain"
    BAD = "bad"


@dataclass(frozen=True, slots=True)
class Reading:
    """One value of one tag."""

    value: float
    """Value in the tag's unit; NaN for a manual output that is on automatic."""
    quality: Quality
    """How far it can be trusted."""
    at_s: float
    """Process time at which it was taken [s]."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Every reading of the plant at one moment."""

    at_s: float
    """Process time [s]."""
    values: Mapping[str, float]
    """Tag name -> value in the tag's unit; NaN for a manual output that is on automatic."""
    bad: frozenset[str] = frozenset()
    """Tags whose reading must not be used."""

    def reading(self, tag: str) -> Reading:
        """The reading of ``tag``; KeyError where the plant does not have it."""
        quality = Quality.BAD if tag in self.bad else Quality.GOOD
        return Reading(self.values[tag], quality, self.at_s)


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Tags of one or many members over equally spaced times."""

    start_s: float
    """Process time of the first sample [s]."""
    dt_s: float
    """Sampling period [s]."""
    signals: Mapping[str, NDArray[np.float64]]
    """Tag name -> values, shape (members, times), in the tag's unit."""

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Process times of the samples [s], shape (times,)."""
        return self.start_s + self.dt_s * np.arange(self.length, dtype=np.float64)

    @property
    def length(self) -> int:
        """Number of samples."""
        return int(next(iter(self.signals.values())).shape[1])

    @property
    def members(self) -> int:
        """Number of members."""
        return int(next(iter(self.signals.values())).shape[0])
