"""A trace that guard and recovery share: one event at a time, and times that never decrease."""

from __future__ import annotations

import math
import threading

from homeostat.domain.ports import GuardEvent
from homeostat.trace.events import Subscriber, Trace


class SharedTrace:
    """Implements :class:`homeostat.trace.events.Trace` and the guard's record over another trace, for two threads.

    What recovery reports from before the guard's last tick is recorded at that tick: nothing is told in hindsight.
    """

    def __init__(self, trace: Trace) -> None:
        """``trace`` is used by nobody else."""
        self._trace = trace
        self._one = threading.RLock()
        self._last_s = -math.inf

    @property
    def last_s(self) -> float:
        """Process time of the last event; 0 before the first [s]."""
        return max(self._last_s, 0.0)

    def record(self, event: GuardEvent, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]."""
        with self._one:
            self._trace.record(event, max(at_s, self._last_s))
            self._last_s = max(at_s, self._last_s)

    def subscribe(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event; it may be called from either thread, one at a time."""
        with self._one:
            self._trace.subscribe(subscriber)

    def sync(self) -> None:
        """Return when everything that was recorded is safe, where the trace underneath has such a promise."""
        sync = getattr(self._trace, "sync", None)
        if sync is not None:  # outside the lock: a disk that hangs must keep nobody from recording
            sync()
