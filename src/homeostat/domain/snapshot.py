"""What the plant says: readings at one moment, and trajectories over time."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

WILD: Final = 1e12
"""No plant has a reading as large as this, in any unit: it is what an instrument shows that has nothing to show. A sum
with it in it has no digits left for what the plant does."""


class Quality(StrEnum):
    """How far a reading can be trusted (OPC UA severity classes)."""

    GOOD = "good"
    UNCERTAIN = "uncertain"
    BAD = "bad"


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Every reading of the plant at one moment."""

    at_s: float
    """Process time [s]."""
    values: Mapping[str, float]
    """Tag name -> value in the tag's unit; NaN for a manual output that is on automatic."""
    bad: frozenset[str] = frozenset()
    """Tags whose reading must not be used."""
    uncertain: frozenset[str] = frozenset()
    """Tags whose reading may be used with care."""
    reasons: Mapping[str, str] = field(default_factory=dict)
    """Tag -> why its reading is not good."""
    taken_s: Mapping[str, float] = field(default_factory=dict)
    """Tag -> process time at which its value was taken, where that is not ``at_s`` [s]."""
    frozen_s: Mapping[str, float] = field(default_factory=dict)
    """Tag -> process time from which its reading repeats itself although it has noise [s]; it is bad then, too."""
    accepted: Mapping[str, float | None] = field(default_factory=dict)
    """Writable tag -> the target that the plant has accepted, in the tag's unit; None for automatic."""


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
