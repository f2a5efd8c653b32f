"""Process time on a link: whole ticks that never stand and never run back, whatever the plant's clock says."""

import math
from typing import Final

from homeostat.domain.plant.timing import REFERENCE, Timing

AHEAD: Final = 0.75
"""By how much of a tick samples may come earlier than our clock has them: the one before was late, perhaps."""

STANDS: Final = 1.5
"""So many ticks after which a clock of the plant that has not gone on stands."""
LATEST_S: Final = 1e12
"""Process time beyond which a clock says nothing [s]: a tick more must be another number."""
LEAP_S: Final = 86_400.0
"""By how much more than has passed by our clock the plant's may go on at once [s]: beyond that it was set anew."""


class ProcessTime:
    """From what the plant says, or from our own clock where it says nothing."""

    def __init__(self, pace: float = 1.0, timing: Timing = REFERENCE, publish_s: float = 0.0) -> None:
        """``pace``: process seconds per wall-clock second; ``timing``: how often the plant is sampled.

        ``publish_s``: how long a sample may be on its way before it is missing, wall-clock [s].
        """
        self._publish_s = publish_s
        self.pace, self._timing = pace, timing
        """Process seconds per wall-clock second, and how often the plant is sampled."""
        self._offset_s, self._told_s = 0.0, math.nan
        self._began: tuple[float, float] | None = None
        self._seen_s = math.nan
        self._sampled_s = 0.0
        self.now_s = 0.0
        """Process time of the last tick [s]."""

    def sample(self, told_s: float | None, at_s: float, waiting: int = 0) -> float | None:
        """The time of a sample that came at ``at_s`` of our monotonic clock [s]; None where its tick was there already.

        ``told_s``: process time as the plant says it [s]. Where that runs back, ours goes on by a tick and follows the
        plant's from there: a server that began again is no reason for time to run back. So it is where it leaps ahead
        by a day more than has passed: one wild reading would end every deadline, and time with them. Where the plant
        says nothing, or its clock stands, samples are counted as they come, as long as they do not run ahead of ours;
        ``waiting``: how many came behind this one already.
        """
        told = told_s is not None and abs(told_s) <= LATEST_S
        ticks_s = self._timing.at_s(self._timing.ticks(told_s)) if told and told_s is not None else math.nan
        if not told:
            now_s = self._by_ours(at_s, waiting)
        elif ticks_s != self._told_s:
            now_s = self._by_theirs(ticks_s, at_s)
        elif self._began is not None or (at_s - self._seen_s) * self.pace >= STANDS * self._timing.tick_s:
            now_s = self._by_ours(at_s, waiting)
        else:
            now_s = None
        if told:
            self._told_s = ticks_s
        if now_s is not None:
            self.now_s = self._sampled_s = now_s
            self._seen_s = at_s
        return now_s

    @property
    def tick_s(self) -> float:
        """Process time between two samples [s]."""
        return self._timing.tick_s

    def passed(self, told_s: float | None) -> bool:
        """Whether a tick without a sample has stood for this one, of which the plant says ``told_s`` [s]."""
        if told_s is None or not abs(told_s) <= LATEST_S or math.isnan(self._told_s):
            return False
        ticks_s = self._timing.at_s(self._timing.ticks(told_s))
        return ticks_s > self._told_s and ticks_s + self._offset_s <= self.now_s

    def _by_theirs(self, ticks_s: float, at_s: float) -> float:
        """The plant has gone on, or back, to ``ticks_s`` [s]."""
        self._began = None
        ahead_s = ticks_s + self._offset_s - self.now_s
        leapt = ahead_s > LEAP_S + (at_s - self._seen_s) * self.pace  # never at the first sample: nothing was seen
        if ahead_s <= 0.0 or leapt:
            self._offset_s = self.now_s + self._timing.tick_s - ticks_s
        return ticks_s + self._offset_s

    def _by_ours(self, at_s: float, waiting: int) -> float | None:
        """One tick later, or as many as have passed; None for more samples than there are ticks."""
        tick_s = self._timing.tick_s
        if self._began is None:
            began_s = at_s if math.isnan(self._seen_s) else self._seen_s
            self._began = began_s, self.now_s + (tick_s if math.isnan(self._seen_s) else 0.0)
        since_s, from_s = self._began
        passed_s = from_s + (at_s - since_s) * self.pace
        following = self._timing.ticks(self.now_s) + 1
        now_s = self._timing.at_s(max(self._timing.whole_ticks(passed_s) - waiting, following))
        return None if now_s > passed_s + AHEAD * tick_s else now_s

    def absent(self, at_s: float) -> float:
        """The time of a tick without a sample, at ``at_s`` of our monotonic clock [s]."""
        if not math.isnan(self._seen_s):
            passed = self._timing.whole_ticks((at_s - self._seen_s - self._publish_s) * self.pace)
            self.now_s = max(self.now_s, self._sampled_s + self._timing.at_s(max(passed, 0)))
        return self.now_s
