"""Autoencoder: what a row loses on its way through a narrow network (extra ``monitor``)."""

import warnings
from collections.abc import Sequence
from typing import Any, Final, final

import numpy as np

from homeostat.detectors.detector import Learned, Values

SWEEPS: Final = 200
"""Most passes over the rows while it learns."""
_LEAST: Final = 1e-3
"""Least deviation of a signal's error [standard deviations of the signal]."""


@final
class Autoencoder:
    """One statistic: the mean squared error of a row's signals, each in deviations of its own error."""

    name = "autoencoder"

    def __init__(self, seed: int) -> None:
        """``seed``: of the first weights and of the order of the rows."""
        self._seed = seed

    def learn(self, runs: Sequence[Values]) -> Learned:
        """Train the network to give back its rows: signals, half of them, a quarter, half, signals."""
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.neural_network import MLPRegressor

        rows = np.concatenate(runs)
        half, quarter = max(2, rows.shape[1] // 2), max(1, rows.shape[1] // 4)
        layers = (half, quarter, half)
        network = MLPRegressor(hidden_layer_sizes=layers, activation="tanh", max_iter=SWEEPS, random_state=self._seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # it is as good as that many passes make it
            network.fit(rows, rows[:, 0] if rows.shape[1] == 1 else rows)
        learned = _Network(network, np.ones(rows.shape[1]))
        return _Network(network, np.maximum(np.sqrt((learned.errors(rows) ** 2).mean(axis=0)), _LEAST))


@final
class _Network:
    def __init__(self, network: Any, deviation: Values) -> None:
        self._network, self._deviation = network, deviation

    def errors(self, rows: Values) -> Values:
        back: Values = rows - np.asarray(self._network.predict(rows)).reshape(rows.shape)
        return back

    def statistics(self, rows: Values) -> Values:
        means: Values = ((self.errors(rows) / self._deviation) ** 2).mean(axis=1, keepdims=True)
        return means
