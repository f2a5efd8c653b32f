"""What the guard sees and journals, on its way to the historian; the guard's tick waits for none of it."""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Final, final

from homeostat.history.occurrences import occurrence
from homeostat.journal import Event
from homeostat.links.opcua.reading.node_sample import NodeSample
from homeostat.service.historian.line import HistoryLine
from homeostat.service.historian.observed import Observed

FLUSH_S: Final = 2.0
"""Longest that a stop waits until everything is kept, wall-clock [s]."""
_WAITING: Final = 600
"""Most samples that wait to be put into columns."""


@final
class Recording:
    """Puts samples into columns in a thread of its own, in the order in which they came."""

    def __init__(self, line: HistoryLine, observed: Observed, plant: str) -> None:
        self._line, self._observed, self._plant = line, observed, plant
        self._waiting: deque[NodeSample] = deque(maxlen=_WAITING)
        self._wanted, self._over = threading.Event(), False
        self._thread = threading.Thread(target=self._put_on, name="recording", daemon=True)
        self._thread.start()

    def see(self, sample: NodeSample) -> None:
        """Have ``sample`` kept; returns at once."""
        if len(self._waiting) == _WAITING:
            self._line.miss()
        self._waiting.append(sample)
        self._wanted.set()

    def hear(self, event: Event, at_s: float) -> None:
        """Have ``event`` of the journal kept; returns at once."""
        now_us = time.time_ns() // 1000
        self._line.keep(occurrence(event, self._plant, now_us, now_us, ""))

    def close(self) -> None:
        """Have the rest kept, if that is soon done."""
        self._over = True
        self._wanted.set()
        self._thread.join(FLUSH_S)
        self._line.close(FLUSH_S)

    def _put_on(self) -> None:
        while not self._over or self._waiting:
            self._wanted.wait()
            self._wanted.clear()
            while self._waiting:
                self._line.keep(self._observed.batch(self._waiting.popleft()))
