"""A table of signals: one row per moment, one column per signal."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from homeostat.detectors.detector import Values
from homeostat.detectors.error import DetectionError

MOST_MISSING: Final = 0.05
"""Largest share of a signal's rows without a value [1]; the last value stands for them."""

NO_MEASUREMENT: Final = 1e100
"""What is as large, in whatever unit, was not measured: it counts as missing."""


@dataclass(frozen=True, slots=True)
class SignalTable:
    """Signals at common moments."""

    name: str
    """Where it comes from, for people."""
    signals: tuple[str, ...]
    """Names of the columns, each once."""
    times: Values
    """Rising times, shape (rows,) [s]; row numbers where the table has no times."""
    values: Values
    """One column per signal in its unit, NaN where there is no value, shape (rows, signals)."""
    start: str = ""
    """The moment of time 0 in ISO 8601, with a Z in UTC; empty where the times are not of the calendar."""
    time: str | None = ""
    """Name of the column that had the times; empty where they were in none, None where rows are counted."""
    left_out: tuple[str, ...] = ()
    """Names of the columns of its source that were left out."""

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.times)

    @property
    def timed(self) -> bool:
        """Whether the table has times of its own."""
        return self.time is not None

    @property
    def step(self) -> float:
        """The usual time from one row to the next [s]."""
        return float(np.median(np.diff(self.times))) if len(self) > 1 else 1.0

    def told(self, row: int) -> str:
        """When ``row`` was, for people."""
        if not self.timed:
            return f"row {row + 1}"
        if not self.start:
            return f"{self.times[row]:g} s"
        begin = self.start.removesuffix("Z")
        moment = np.datetime64(begin, "ms") + np.timedelta64(round(self.times[row] * 1e3), "ms")
        return str(moment).removesuffix(".000").replace("T", " ") + self.start[len(begin) :]

    def of(self, signals: Sequence[str]) -> Self:
        """The same with the columns ``signals``, in their order."""
        places = [self.signals.index(name) for name in signals]
        return replace(self, signals=tuple(signals), values=self.values[:, places])

    def without(self, signals: Sequence[str]) -> Self:
        """The same with the columns ``signals`` left out, where it has them; DetectionError where none is left."""
        kept = [name for name in self.signals if name not in signals]
        if not kept:
            raise DetectionError(f"{self.name}: no signal is left; leave out fewer of {', '.join(self.signals)}")
        return replace(self.of(kept), left_out=tuple(name for name in signals if name in self.signals))

    def filled(self) -> Self:
        """The same with every value known: the last one stands for what is missing, the first for what is before it.

        Raises DetectionError where more than `MOST_MISSING` of a signal is missing.
        """
        values = np.where(np.abs(self.values) < NO_MEASUREMENT, self.values, np.nan)
        missing = np.isnan(values)
        if not missing.any():
            return self
        for column, name in enumerate(self.signals):
            share, first = float(missing[:, column].mean()), int(missing[:, column].argmax())
            if share > MOST_MISSING:
                text = f"{self.name}: {name!r} has no value in {share:.1%} of the rows, first in row {first + 1}"
                raise DetectionError(
                    f"{text}; at most {MOST_MISSING:.0%} may be missing; leave it out with --ignore {name!r}"
                )
        place = np.where(missing, 0, np.arange(len(values))[:, None])
        latest = np.maximum.accumulate(place, axis=0)
        first_known = np.argmin(missing, axis=0)
        filled = np.take_along_axis(values, np.maximum(latest, first_known[None]), axis=0)
        return replace(self, values=filled)
