"""Readings as a plant's control system gives them: noisy process values of 14-bit transmitters, setpoints, switches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from homeostat.history.samples import Batch

SECOND_US = 1_000_000
CONTROLLERS = 20
"""Stations whose tags share their times."""
STEPS = 1 << 14
"""Steps of a transmitter's span."""


@dataclass(frozen=True)
class Shares:
    """How a plant's tags are divided."""

    noisy: float = 0.7
    """Process values: drift, and noise of 0.1 % of span."""
    stepped: float = 0.2
    """Setpoints and the like: a change every half an hour."""


class PlantReadings:
    """Batches, one a second, of ``tags`` tags; the same for the same ``seed``."""

    def __init__(self, tags: int, start_us: int, seed: int = 1) -> None:
        """Begin at ``start_us`` [us]."""
        self._rng = np.random.default_rng(seed)
        self._n, self._now_us = tags, start_us
        self.tags = tuple(f"unit{k // 50:02d}.{'FTLP'[k % 4]}I{k:04d}.pv" for k in range(tags))
        kinds = np.arange(tags) / tags
        shares = Shares()
        self._noisy = kinds < shares.noisy
        self._stepped = ~self._noisy & (kinds < shares.noisy + shares.stepped)
        self._span = self._rng.choice([1.6, 10.0, 100.0, 250.0], tags)
        self._low = self._rng.choice([0.0, -50.0, 273.15], tags)
        self._level = self._rng.random(tags)
        self._station = self._rng.integers(0, CONTROLLERS, tags)
        self._phase_us = self._rng.integers(0, 900, CONTROLLERS) * 1000

    def hour(self, seconds: int = 3600) -> Iterator[Batch]:
        """The batches of the next ``seconds``."""
        drift = np.cumsum(self._rng.normal(0.0, 2e-5, (seconds, self._n)), axis=0)
        noise = self._rng.normal(0.0, 1e-3, (seconds, self._n))
        share = np.clip(self._level + drift + noise, 0.0, 1.0)
        values = self._low + self._span * np.round(share * STEPS) / STEPS
        changes = np.cumsum(self._rng.random((seconds, self._n)) < 1 / 1800, axis=0)
        values = np.where(self._stepped, np.round((self._level * 100 + 7 * changes) % 100, 1), values)
        values = np.where(self._noisy | self._stepped, values, changes % 2)
        self._level = np.clip(self._level + drift[-1], 0.1, 0.9)
        for k in range(seconds):
            yield self._batch(values[k])

    def _batch(self, values: NDArray[np.float64]) -> Batch:
        source = self._now_us + self._phase_us + self._rng.integers(0, 5, CONTROLLERS) * 1000
        server = source + self._rng.integers(1000, 9000, CONTROLLERS)
        own = self._now_us + SECOND_US + int(self._rng.integers(0, 30_000))
        self._now_us += SECOND_US
        quality = np.where(self._rng.random(self._n) < 1e-4, 0x40900000, 0).astype(np.uint32)
        return Batch(self.tags, source[self._station], values, quality, server[self._station], own)
