"""CVA: what the last rows say of the next ones (canonical variates), and what they do not."""

from collections.abc import Sequence
from typing import Final, final

import numpy as np

from homeostat.detectors.detector import Learned, Values

LAGS: Final = 3
"""Rows of the past, and of the future."""
STATES: Final = 25
"""Most canonical variates that are states: about as many as Russell, Chiang and Braatz (2000) keep."""
_RIDGE: Final = 1e-6
"""Least variance in a direction, as a share of the largest [1]."""


def past(rows: Values, lags: int = LAGS) -> Values:
    """Each row beside those before it, newest first, shape (rows, lags * signals).

    The first row stands for earlier ones.
    """
    early = np.repeat(rows[:1], lags - 1, axis=0)
    padded = np.concatenate([early, rows])
    return np.concatenate([padded[lags - 1 - k : len(padded) - k] for k in range(lags)], axis=1)


@final
class Cva:
    """Two statistics: T2 of the states, and T2 of the rest of the past.

    Canonical variate analysis as by Larimore (1983) and Russell, Chiang and Braatz, "Fault detection in industrial
    processes using canonical variate analysis and dynamic principal component analysis" (2000).
    """

    name = "cva"

    def learn(self, runs: Sequence[Values]) -> Learned:
        """Learn which combinations of the past tell most of the future."""
        before = np.concatenate([past(run)[LAGS - 1 : len(run) - LAGS] for run in runs])
        after = np.concatenate([_future(run) for run in runs])
        centre = before.mean(axis=0)
        before, after = before - centre, after - after.mean(axis=0)
        count = max(len(before) - 1, 1)
        whiten = _inverse_root(before.T @ before / count)
        cross = _inverse_root(after.T @ after / count) @ (after.T @ before / count) @ whiten
        directions = np.linalg.svd(cross, full_matrices=False)[2]
        kept = directions[: min(STATES, max(len(directions) // 2, 1))]
        return _Variates(centre, whiten, kept)


def _future(run: Values) -> Values:
    """The rows after each one that has enough before and after it, shape (rows, lags * signals)."""
    first, count = LAGS, len(run) - 2 * LAGS + 1
    return np.concatenate([run[first + k : first + k + count] for k in range(LAGS)], axis=1)


def _inverse_root(covariance: Values) -> Values:
    """The symmetric inverse square root of ``covariance``, with a least variance in every direction."""
    variances, directions = np.linalg.eigh(covariance)
    variances = np.maximum(variances, max(_RIDGE * float(variances[-1]), 1e-12))
    root: Values = (directions / np.sqrt(variances)) @ directions.T
    return root


@final
class _Variates:
    def __init__(self, centre: Values, whiten: Values, directions: Values) -> None:
        self._centre, self._whiten, self._directions = centre, whiten, directions

    def statistics(self, rows: Values) -> Values:
        white = (past(rows) - self._centre) @ self._whiten
        states = white @ self._directions.T
        rest = white - states @ self._directions
        return np.stack([(states**2).sum(axis=1), (rest**2).sum(axis=1)], axis=1)
