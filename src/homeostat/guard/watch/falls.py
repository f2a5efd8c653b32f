"""Falls: margins that have fallen within seconds by more than the process can make them fall.

Such a margin is not believed at once: no such heat, no such flow is there, while an instrument that breaks shows it. A
step from one reading to the next is seen by the quality of a reading already; what comes through the filter of a
transmitter takes some seconds, each of them within the noise, and is seen here: the mean of the last `NOW` readings
against that of `BEFORE` readings that ended some ticks before.
"""

import math
from collections import deque
from collections.abc import Mapping

from homeostat.stl.formula import Expression

NOW, BEFORE = 3, 5
"""Readings of which a mean is taken."""
LAGS = range(2, 9)
"""Ticks between the last reading before and the last one: any of these may hold the fall."""
QUIET = 30
"""Readings before both that say how far the margin scatters, slow courses included."""
DEVIATIONS = 4.5
"""How far the means may be apart by noise [standard deviations of the difference of two means]."""
COLOUR = 1.3
"""By how much the noise of means may be larger than that of white noise [1]."""
_MOST = max(LAGS) + BEFORE + QUIET


class Falls:
    """Follows the margin of one limit, one call per tick."""

    def __init__(self, fastest: Expression | None, tick_s: float) -> None:
        """``fastest``: by how much the process can make it fall, in its unit per second; None where nobody says."""
        self._fastest, self._tick_s = fastest, tick_s
        self._margins: deque[float] = deque(maxlen=_MOST)

    def take(self, margin: float, values: Mapping[str, float]) -> bool:
        """Take the margin of one more tick; whether it has fallen faster than it can."""
        if self._fastest is None:
            return False
        if math.isnan(margin):  # NaN: what comes after it cannot be compared with what was before
            self._margins.clear()
            return False
        self._margins.append(margin)
        if len(self._margins) < _MOST:
            return False
        rate = self._fastest.value(values)
        if not 0.0 <= rate < math.inf:
            return False
        margins = list(self._margins)
        quiet = margins[:QUIET]
        middle = _mean(quiet)
        scatter = _mean([(m - middle) ** 2 for m in quiet]) ** 0.5
        noise = DEVIATIONS * COLOUR * scatter * (1.0 / NOW + 1.0 / BEFORE) ** 0.5
        now = _mean(margins[-NOW:])
        return any(_fallen(margins, lag, now) > rate * (lag + 1) * self._tick_s + noise for lag in LAGS)

    def forget(self) -> None:
        """What follows is another margin."""
        self._margins.clear()


def _fallen(margins: list[float], lag: int, now: float) -> float:
    """By how much the mean has fallen since the readings that ended ``lag`` ticks before the last one."""
    end = len(margins) - lag
    return _mean(margins[end - BEFORE : end]) - now


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)
