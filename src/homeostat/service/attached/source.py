"""The reading side of an attached plant: the guard waits for the next sample, and its time goes on over restarts."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import final

from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.domain.ports import Source
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LinkError

SLACK_S = 0.5
"""By how much a sample may come late before a tick goes on without it, wall-clock [s]."""


@final
class Onward:
    """Implements :class:`homeostat.domain.ports.Source` over a link's: as its own, with times that never run back."""

    never_blocks = False
    """It waits for the next sample, for a bounded time."""

    def __init__(self, link: Source, after_s: float, pace: float, timing: Timing = REFERENCE) -> None:
        """``after_s``: process time at which the journal ends [s]; ``pace``: process seconds per wall-clock second.

        ``timing``: how often the plant is sampled.
        """
        self._link, self._pace, self._timing = link, pace, timing
        self._now_s, self._offset_s = timing.at_s(math.ceil(after_s / timing.tick_s)), 0.0
        self._stopped = False
        self.alive: Callable[[], object] = lambda: None
        """Is called while a sample is waited for, however long that takes."""
        self._synchronised, self._began = False, time.monotonic()
        self._due = time.monotonic()

    @property
    def period_s(self) -> float:
        """Wall-clock time between two samples [s]."""
        return self._timing.tick_s / self._pace

    @property
    def now_s(self) -> float:
        """Process time of the last tick [s]."""
        return self._now_s

    @property
    def ended(self) -> bool:
        """Whether the link was closed."""
        return self._link.ended

    def stop(self) -> None:
        """Wait for no sample any more."""
        self._stopped = True

    def advance(self) -> Snapshot | None:
        """The next sample; None where none came in time, LinkError where there is no connection."""
        due = max(self._due, time.monotonic())
        sample, trouble = None, None
        while sample is None and not self._stopped:
            self.alive()
            try:
                sample, trouble = self._link.advance(), None
            except LinkError as broken:
                trouble = broken
            if time.monotonic() >= due:
                break
        self._due = time.monotonic() + self.period_s + SLACK_S
        if sample is not None:
            return self._shifted(sample)
        self._absent()
        if trouble is not None:
            raise trouble
        return None

    def _shifted(self, sample: Snapshot) -> Snapshot:
        """``sample`` in the time of the journal, which may have begun before the plant's did."""
        if not self._synchronised:
            self._synchronised = True
            self._offset_s = 0.0 if sample.at_s > self._now_s else self._now_s + self._timing.tick_s - sample.at_s
        self._now_s = sample.at_s + self._offset_s
        if self._offset_s == 0.0:
            return sample
        taken_s = {tag: at_s + self._offset_s for tag, at_s in sample.taken_s.items()}
        return replace(sample, at_s=self._now_s, taken_s=taken_s)

    def _absent(self) -> None:
        """A tick without a sample."""
        if self._synchronised:
            self._now_s = max(self._now_s, self._link.now_s + self._offset_s)
        else:
            self._now_s += self._timing.tick_s
