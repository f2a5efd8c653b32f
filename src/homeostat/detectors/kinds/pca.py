"""PCA: inside the plane in which fault-free rows lie (T2), and away from it (SPE)."""

from collections.abc import Sequence
from typing import Final, final

import numpy as np

from homeostat.detectors.detector import Learned, Values

EXPLAINED: Final = 0.9
"""Share of the variance that the principal components keep [1]."""


@final
class Pca:
    """Two statistics: Hotelling's T2 of the principal components, and the squared prediction error.

    Jackson and Mudholkar, "Control procedures for residuals associated with principal component analysis" (1979).
    """

    name = "pca"

    def learn(self, runs: Sequence[Values]) -> Learned:
        """Learn the principal components."""
        rows = np.concatenate(runs)
        _, singular, directions = np.linalg.svd(rows - rows.mean(axis=0), full_matrices=False)
        variances = singular**2 / max(len(rows) - 1, 1)
        shares = np.cumsum(variances) / max(float(variances.sum()), 1e-12)
        kept = min(int(np.searchsorted(shares, EXPLAINED)) + 1, max(len(variances) - 1, 1))
        return _Plane(rows.mean(axis=0), directions[:kept].T, np.maximum(variances[:kept], 1e-9))


@final
class _Plane:
    def __init__(self, centre: Values, directions: Values, variances: Values) -> None:
        self._centre, self._directions, self._variances = centre, directions, variances

    def statistics(self, rows: Values) -> Values:
        inside = (rows - self._centre) @ self._directions
        away = rows - self._centre - inside @ self._directions.T
        return np.stack([(inside**2 / self._variances).sum(axis=1), (away**2).sum(axis=1)], axis=1)
