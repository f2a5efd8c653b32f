"""From scores to alarms: stretches of rows that are out of the ordinary, and which signals it is in."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from homeostat.detectors.learning import Judged

LASTING: Final = 6
"""Rows in a row that are an alarm (Russell, Chiang and Braatz, 2000): fewer are what the stated rate lets through."""
NAMED: Final = 3
"""Most signals that are named with an alarm."""


@dataclass(frozen=True, slots=True)
class Alarm:
    """A stretch of rows that are out of the ordinary, but for short gaps."""

    first: int
    """Its first row, from 0."""
    last: int
    """Its last row."""
    peak: float
    """Largest score [1]: 1 is the limit."""
    detectors: tuple[str, ...]
    """Detectors that were beyond their limit in it, those with the most rows first."""
    signals: tuple[tuple[str, float], ...]
    """Signals that depart most, and how far [their fault-free limit]."""

    @property
    def rows(self) -> int:
        """How many rows it lasts."""
        return self.last - self.first + 1


def alarms(judged: Judged, detectors: Sequence[str], signals: Sequence[str], from_row: int = 0) -> tuple[Alarm, ...]:
    """The alarms from ``from_row`` on, in time order."""
    beyond = judged.scores > 1.0
    over = beyond.any(axis=1) & (np.arange(len(beyond)) >= from_row)
    return tuple(_alarm(judged, beyond, slice(*ends), (detectors, signals)) for ends in _stretches(over))


def _stretches(over: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row and end of each alarm: those that fewer than `LASTING` rows part are one."""
    edges = np.flatnonzero(np.diff(np.r_[False, over, False].astype(np.int8)))
    joined: list[tuple[int, int]] = []
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if end - first < LASTING:
            continue
        if joined and first - joined[-1][1] < LASTING:
            joined[-1] = joined[-1][0], end
        else:
            joined.append((first, end))
    return joined


def _alarm(judged: Judged, beyond: NDArray[np.bool_], span: slice, names: tuple[Sequence[str], Sequence[str]]) -> Alarm:
    counts = beyond[span].sum(axis=0)
    order = [k for k in np.argsort(-counts, kind="stable") if counts[k]]
    means = judged.signals[span].mean(axis=0)
    worst = np.argsort(-means, kind="stable")[:NAMED]
    named = tuple((names[1][k], float(means[k])) for k in worst if means[k] > 1.0 or k == worst[0])
    peak = float(judged.scores[span].max())
    return Alarm(span.start, span.stop - 1, peak, tuple(names[0][k] for k in order), named)
