"""Which signals have a level of their own: one that has none is watched by its changes from row to row."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from homeostat.detectors.detector import Values

CRITICAL: Final = 0.739
"""KPSS statistic above which a level is rejected at 1 % [1] (Kwiatkowski and others, 1992, table 1)."""


def kpss(rows: Values) -> Values:
    """The KPSS statistic of each signal's level, shape (signals,) [1]; 0 where a signal does not move.

    The long-run variance is Newey and West's, with 12 (n/100)^(1/4) lags: Kwiatkowski, Phillips, Schmidt and Shin,
    "Testing the null hypothesis of stationarity against the alternative of a unit root" (1992), l12.
    """
    count = len(rows)
    errors = rows - rows.mean(axis=0)
    lags = min(int(12.0 * (count / 100.0) ** 0.25), count - 1)
    variance = (errors**2).mean(axis=0)
    for lag in range(1, lags + 1):
        weight = 2.0 * (1.0 - lag / (lags + 1.0))
        variance = variance + weight * (errors[lag:] * errors[:-lag]).sum(axis=0) / count
    sums = (np.cumsum(errors, axis=0) ** 2).sum(axis=0) / count**2
    moves = variance > 1e-12 * (1.0 + rows.mean(axis=0) ** 2)
    statistic: Values = np.divide(sums, variance, out=np.zeros_like(sums), where=moves)
    return statistic


def wandering(runs: Sequence[Values]) -> NDArray[np.bool_]:
    """Which signals have no level in more than half of the fault-free ``runs``, shape (signals,)."""
    return np.median([kpss(run) for run in runs], axis=0) > CRITICAL


def levelled(rows: Values, wander: NDArray[np.bool_]) -> Values:
    """``rows`` with the signals that ``wander`` replaced by their changes since the row before; 0 in the first row."""
    changes = np.diff(rows, axis=0, prepend=rows[:1])
    return np.where(wander, changes, rows)
