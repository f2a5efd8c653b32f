"""EWMA: each signal's exponentially weighted mean against how far that mean wanders in fault-free rows."""

from collections.abc import Sequence
from typing import Final, final

import numpy as np

from homeostat.detectors.detector import Learned, Values

WEIGHT: Final = 0.2
"""Share of the newest row in the mean [1]: the usual value for small shifts (Lucas and Saccucci, 1990)."""
SETTLED: Final = 20
"""Rows after which the mean has forgotten that it began at zero."""
_LEAST: Final = 1e-3
"""Least wandering of a mean [standard deviations of the signal]."""


def weighted_means(rows: Values, weight: float = WEIGHT) -> Values:
    """Exponentially weighted means of ``rows``, from zero on, shape (rows, signals), in the unit of the rows."""
    means, mean = np.empty_like(rows), np.zeros(rows.shape[1])
    for k, row in enumerate(rows):
        mean = mean + weight * (row - mean)
        means[k] = mean
    return means


@final
class Ewma:
    """One statistic per signal: its weighted mean in standard deviations of that mean.

    The deviation is measured, not derived from the signal's: fault-free rows of a process depend on the rows before.
    """

    name = "ewma"

    def learn(self, runs: Sequence[Values]) -> Learned:
        """Learn how far the weighted means wander."""
        settled = [weighted_means(run)[min(SETTLED, len(run) // 2) :] for run in runs]
        return _Means(np.maximum(np.sqrt(np.mean(np.concatenate(settled) ** 2, axis=0)), _LEAST))


@final
class _Means:
    def __init__(self, deviation: Values) -> None:
        self._deviation = deviation

    def statistics(self, rows: Values) -> Values:
        return np.abs(weighted_means(rows)) / self._deviation
