"""Pace: the guard's own time, which goes on whatever the clock says."""

from __future__ import annotations

import math

LEAP = 10.0
"""Periods by which a clock may go ahead within a tick and be believed at once [1]."""


class Pace:
    """Takes the time of each tick from a clock that may stand, run back, leap, or say nothing that is a time."""

    def __init__(self) -> None:
        """Before the first tick."""
        self.now_s = -math.inf
        """The guard's time [s]; minus infinity before the first tick."""
        self._period_s: float | None = None
        self._leapt_s: float | None = None

    def advance(self, now_s: float) -> str:
        """Go on to ``now_s`` [s]; what is wrong with it, or empty.

        Time never stands: where the clock does, it goes on by half a period, and can be caught up. A clock that leaps
        ahead is believed once it has gone on from there; until then a period has passed.
        """
        told = now_s if isinstance(now_s, int | float) and math.isfinite(now_s) else -math.inf
        step_s, first = told - self.now_s, not math.isfinite(self.now_s)
        learned = self._period_s is None or step_s <= LEAP * self._period_s
        if told > self.now_s and (first or learned or (self._leapt_s is not None and told > self._leapt_s)):
            if not first and learned:
                self._period_s = step_s
            self.now_s, self._leapt_s = float(told), None
            return ""
        wrong = f"the clock says {now_s!r} s after {self.now_s:g} s"
        period_s = self._period_s or 1.0
        self._leapt_s = told if told > self.now_s else None
        passed_s = period_s if self._leapt_s is not None else period_s / 2.0
        self.now_s = 0.0 if first else self.now_s + passed_s
        return wrong
