"""Minimum and maximum over sliding windows of a signal, with the sample that decides."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IndexArray: TypeAlias = NDArray[np.intp]

NOWHERE = -1
"""Sample index where no sample decides: a constant or an empty window."""


@dataclass(frozen=True, slots=True, eq=False)
class Decided:
    """Values over time, and for each of them the sample that decided it."""

    value: FloatArray
    """Shape (members or 1, samples)."""
    at: IndexArray | None
    """Index of the deciding sample or `NOWHERE`, shape (members or 1, samples); None when not asked for."""

    def __neg__(self) -> Decided:
        """The values with the opposite sign, decided by the same samples."""
        return Decided(-self.value, self.at)

    def cut(self, start: int, stop: int) -> Decided:
        """Samples ``start`` to ``stop - 1``."""
        return Decided(self.value[:, start:stop], None if self.at is None else self.at[:, start:stop])


@dataclass(frozen=True, slots=True)
class Extreme:
    """Smallest or largest: which of two values wins, and what wins over nothing at all."""

    pick: np.ufunc
    """The winner of two arrays, element by element."""
    beats: np.ufunc
    """Whether the first array strictly wins over the second, element by element."""
    empty: float
    """Result over an empty window."""


LOWEST = Extreme(np.minimum, np.less, math.inf)
HIGHEST = Extreme(np.maximum, np.greater, -math.inf)


def better(extreme: Extreme, first: Decided, second: Decided) -> Decided:
    """The winner of two signals at each sample; ``first`` wins ties."""
    if first.at is None or second.at is None:
        return Decided(extreme.pick(first.value, second.value), None)
    wins = extreme.beats(second.value, first.value)
    return Decided(np.where(wins, second.value, first.value), np.where(wins, second.at, first.at))


def over_windows(extreme: Extreme, signal: Decided, width: int, count: int) -> Decided:
    """The winner in ``count`` windows; window ``i`` is samples ``i`` to ``i + width - 1``, clipped to the trace.

    The earliest sample wins ties. Windows double in size until they cover ``width``, so the cost is
    O(samples log width) however long the window is.
    """
    width = min(width, signal.value.shape[1])
    if count == 1:
        return _over_one(extreme, signal.cut(0, width))
    best = padded(extreme, signal, count + width - 1)
    covered = 1
    while covered < width:
        step = min(covered, width - covered)
        length = best.value.shape[1] - step
        best = better(extreme, best.cut(0, length), best.cut(step, step + length))
        covered += step
    return best


def constant(value: float, samples: int, timed: bool) -> Decided:
    """The same value at every sample, decided by none of them."""
    return Decided(np.full((1, samples), value), np.full((1, samples), NOWHERE) if timed else None)


def padded(extreme: Extreme, signal: Decided, length: int) -> Decided:
    """The signal continued to ``length`` samples by values that win over nothing."""
    missing = length - signal.value.shape[1]
    if missing <= 0:
        return signal.cut(0, length)
    value = np.pad(signal.value, ((0, 0), (0, missing)), constant_values=extreme.empty)
    if signal.at is None:
        return Decided(value, None)
    return Decided(value, np.pad(signal.at, ((0, 0), (0, missing)), constant_values=NOWHERE))


def _over_one(extreme: Extreme, signal: Decided) -> Decided:
    if signal.at is None:
        return Decided(extreme.pick.reduce(signal.value, axis=1, keepdims=True), None)
    search = np.argmin if extreme is LOWEST else np.argmax
    best = search(signal.value, axis=1, keepdims=True)
    at = np.take_along_axis(np.broadcast_to(signal.at, signal.value.shape), best, axis=1)
    return Decided(np.take_along_axis(signal.value, best, axis=1), at)
