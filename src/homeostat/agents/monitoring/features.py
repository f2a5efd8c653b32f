"""Features on line: filtered residuals and balances, one value per snapshot, unknown where a reading is."""

import math
from collections import deque

from homeostat.domain.diagnosis import Feature
from homeostat.domain.plant.timing import TICK_S
from homeostat.domain.snapshot import WILD, Snapshot


class FeatureFilter:
    """Computes one feature from a stream of snapshots, however far they are apart."""

    def __init__(self, feature: Feature, tick_s: float = TICK_S) -> None:
        """Start without memory; ``tick_s``: time that the first snapshot stands for [s]."""
        self.feature, self._tick_s = feature, tick_s
        self._filtered: float | None = None
        self._at_s: float | None = None
        self._rate = 0.0
        self._integral = 0.0
        self._stored: deque[tuple[float, float]] = deque()

    def update(self, snapshot: Snapshot) -> float | None:
        """The feature after one more snapshot, in its unit; None while its window fills or a reading is unknown.

        What came in while a reading was unknown is taken to be what came in before.
        """
        values, at_s = snapshot.values, snapshot.at_s
        raw = _known(self.feature.expression.value(values))
        passed_s = self._tick_s if self._at_s is None else at_s - self._at_s
        if self.feature.accumulation is None:
            if math.isnan(raw):
                return None
            self._at_s = at_s
            return self._smooth(raw, passed_s)
        stored = _known(self.feature.accumulation.value(values))
        # What is stored minus everything that came in since the start: constant while the balance closes.
        unexplained = stored - self._integral
        self._rate = self._rate if math.isnan(raw) else raw
        self._integral += self._rate * passed_s
        self._at_s = at_s
        if math.isnan(stored):
            return None
        self._stored.append((at_s, self._smooth(unexplained, passed_s)))
        begin_s = at_s - self.feature.window_s
        while len(self._stored) > 1 and self._stored[1][0] <= begin_s:
            self._stored.popleft()
        if math.isnan(raw) or self._stored[0][0] > begin_s:
            return None
        return self._stored[-1][1] - self._stored[0][1]

    def _smooth(self, raw: float, passed_s: float) -> float:
        """First-order lag by time, so that samples further apart count for more."""
        before = raw if self._filtered is None else self._filtered
        lag_s = self.feature.filter_s
        gain = 1.0 - math.exp(-passed_s / lag_s) if lag_s > 0.0 else 1.0
        self._filtered = before + gain * (raw - before)
        return self._filtered


def _known(value: float) -> float:
    """``value``; NaN where an instrument shows infinity, or what it shows where it has nothing to show."""
    return value if abs(value) < WILD else math.nan
