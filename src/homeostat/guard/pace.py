"""Pace: the guard's own time, which goes on whatever the clock says."""

import math
import sys

from homeostat.domain.plant.timing import TICK_S

LEAP = 10.0
"""Periods by which a clock may go ahead within a tick and be believed at once [1]."""


class Pace:
    """Takes the time of each tick from a clock that may stand, run back, leap, or say nothing that is a time."""

    def __init__(self, tick_s: float = TICK_S) -> None:
        """Before the first tick; ``tick_s``: the period that is assumed before the clock has told one [s]."""
        self._tick_s = tick_s
        self.now_s = -math.inf
        """The guard's time [s]; minus infinity before the first tick."""
        self._period_s: float | None = None
        self._told_s = math.nan

    def advance(self, now_s: float) -> str:
        """Go on to ``now_s`` [s]; what is wrong with it, or empty.

        Time never stands: where the clock does, it goes on by half a period, and can be caught up. A clock that leaps
        ahead is believed once it has gone on from there; until then a period has passed. The period is what the clock
        itself says between two ticks: after it has stood, its distance from the guard's time says nothing.
        """
        number = isinstance(now_s, int | float) and abs(now_s) <= sys.float_info.max
        before_s, self._told_s = self._told_s, float(now_s) if number else math.nan
        told_s, step_s, period_s = self._told_s, self._told_s - before_s, self._period_s
        near = period_s is None or told_s - self.now_s <= LEAP * period_s
        if told_s > self.now_s and (near or told_s > before_s > self.now_s):
            if step_s > 0.0:
                self._period_s = step_s
            self.now_s = told_s
            return ""
        wrong = f"the clock says {now_s!r} s after {self.now_s:g} s"
        passed_s = (period_s or self._tick_s) / (1.0 if told_s > self.now_s else 2.0)
        self.now_s = self.now_s + passed_s if math.isfinite(self.now_s) else 0.0
        return wrong
