"""Isolation forest: how few random cuts it takes to part a row from fault-free ones (extra ``monitor``)."""

from collections.abc import Sequence
from typing import Any, Final, final

import numpy as np

from homeostat.detectors.detector import Learned, Values

TREES: Final = 100
"""Trees of a forest, as in Liu, Ting and Zhou, "Isolation forest" (2008)."""


@final
class IsolationForest:
    """One statistic: the anomaly score, between 0 and 1."""

    name = "isolation-forest"

    def __init__(self, seed: int) -> None:
        """``seed``: of the random cuts."""
        self._seed = seed

    def learn(self, runs: Sequence[Values]) -> Learned:
        """Grow the forest."""
        from sklearn import ensemble

        forest = ensemble.IsolationForest(n_estimators=TREES, random_state=self._seed)
        return _Forest(forest.fit(np.concatenate(runs)))


@final
class _Forest:
    def __init__(self, forest: Any) -> None:
        self._forest = forest

    def statistics(self, rows: Values) -> Values:
        scores: Values = -self._forest.score_samples(rows)[:, None]
        return scores
