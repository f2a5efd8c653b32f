"""Process time on a link: whole ticks that never stand and never run back, whatever the plant's clock says."""

import math

from homeostat.domain.plant.timing import REFERENCE, Timing


class ProcessTime:
    """From what the plant says, or from our own clock where it says nothing."""

    def __init__(self, pace: float = 1.0, timing: Timing = REFERENCE) -> None:
        """``pace``: process seconds per wall-clock second; ``timing``: how often the plant is sampled."""
        self._pace, self._timing = pace, timing
        self._offset_s: float | None = None
        self._begin_s = self._seen_s = math.nan
        self._sampled_s = 0.0
        self.now_s = 0.0
        """Process time of the last tick [s]."""

    def sample(self, told_s: float | None, at_s: float) -> float:
        """The time of a new sample that came at ``at_s`` of our monotonic clock [s].

        ``told_s``: process time as the plant says it [s]. Where that does not go on, ours goes on by a tick and
        follows the plant's from there: a server that began again is no reason for time to run back.
        """
        if math.isnan(self._begin_s):
            self._begin_s = at_s
        if told_s is None or not math.isfinite(told_s):
            told_s = (at_s - self._begin_s) * self._pace
        tick_s = self._timing.tick_s
        told_s = self._timing.at_s(self._timing.ticks(told_s))
        if self._offset_s is None:
            self._offset_s = 0.0
            if told_s <= 0.0:
                self._offset_s = tick_s - told_s
        if told_s + self._offset_s <= self.now_s:
            self._offset_s = self.now_s + tick_s - told_s
        self.now_s = self._sampled_s = told_s + self._offset_s
        self._seen_s = at_s
        return self.now_s

    def absent(self, at_s: float) -> float:
        """The time of a tick without a sample, at ``at_s`` of our monotonic clock [s]."""
        if not math.isnan(self._seen_s):
            passed = self._timing.whole_ticks((at_s - self._seen_s) * self._pace)
            self.now_s = max(self.now_s, self._sampled_s + self._timing.at_s(passed))
        return self.now_s
