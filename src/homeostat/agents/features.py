"""Features on line: filtered residuals and balances, one value per snapshot."""

from __future__ import annotations

import math
from collections import deque

from homeostat.domain.diagnosis import Feature
from homeostat.domain.snapshot import Snapshot


class FeatureFilter:
    """Computes one feature from a stream of snapshots, one per second."""

    def __init__(self, feature: Feature) -> None:
        """Start without memory."""
        self.feature = feature
        self._gain = 1.0 - math.exp(-1.0 / feature.filter_s) if feature.filter_s > 0 else 1.0
        self._filtered: float | None = None
        self._integral, self._inflow = 0.0, 0.0
        self._stored: deque[float] = deque(maxlen=int(feature.window_s) + 1)

    def update(self, snapshot: Snapshot) -> float | None:
        """The feature after one more snapshot, in its unit; None while its window fills or where it is not known.

        A snapshot without a value is passed over; a balance goes on with what came in before.
        """
        raw = self.feature.expression.value(snapshot.values)
        if self.feature.accumulation is None:
            return None if math.isnan(raw) else self._smooth(raw)
        # What is stored minus everything that came in since the start: constant while the balance closes.
        unexplained = self.feature.accumulation.value(snapshot.values) - self._integral
        self._inflow = self._inflow if math.isnan(raw) else raw
        self._integral += self._inflow
        unknown = math.isnan(raw) or math.isnan(unexplained)
        self._stored.append(math.nan if unknown else self._smooth(unexplained))
        found = self._stored[-1] - self._stored[0]
        return None if len(self._stored) <= self.feature.window_s or math.isnan(found) else found

    def _smooth(self, raw: float) -> float:
        before = raw if self._filtered is None else self._filtered
        self._filtered = before + self._gain * (raw - before)
        return self._filtered
