"""EWMA: each signal's exponentially weighted mean against how far that mean wanders in fault-free rows."""

from collections.abc import Sequence
from typing import Final, final

import numpy as np

from homeostat.detectors.detector import Learned, Values

WEIGHT: Final = 0.2
"""Share of the newest row in the mean [1]: the usual value for small shifts (Lucas and Saccucci, 1990)."""
SETTLED: Final = 20
"""Rows after which the mean has forgotten that it began at zero."""
_BLOCK: Final = 64
"""Rows whose means are computed at once."""
_LEAST: Final = 1e-3
"""Least wandering of a mean [standard deviations of the signal]."""


def weighted_means(rows: Values, weight: float = WEIGHT) -> Values:
    """Exponentially weighted means of ``rows``, from zero on, shape (rows, signals), in the unit of the rows."""
    lags = np.arange(_BLOCK)
    kernel = np.tril(weight * (1.0 - weight) ** np.abs(lags[:, None] - lags))
    faded = (1.0 - weight) ** (lags + 1.0)
    means, mean = np.empty_like(rows), np.zeros(rows.shape[1])
    for first in range(0, len(rows), _BLOCK):
        block = rows[first : first + _BLOCK]
        count = len(block)
        means[first : first + count] = kernel[:count, :count] @ block + faded[:count, None] * mean
        mean = means[first + count - 1]
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
