"""The reading side of an OPC UA link: one sample per tick, as the plant's counter goes on."""

from __future__ import annotations

import math
import time
from typing import final

from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LinkError
from homeostat.links.opcua.connection.board import Board
from homeostat.links.opcua.connection.keeper import Keeper
from homeostat.links.opcua.mapping import LinkMapping
from homeostat.links.opcua.reading.process_time import ProcessTime
from homeostat.links.opcua.reading.samples import Samples

WAIT_S = 0.4
"""Longest wait for a new sample, wall-clock [s]: the guard's tick waits a little longer."""


@final
class OpcuaSource:
    """Implements :class:`homeostat.domain.ports.Source`."""

    never_blocks = False
    """It waits for the next sample, for a bounded time."""

    def __init__(
        self, keeper: Keeper, board: Board, mapping: LinkMapping, samples: Samples, time_: ProcessTime
    ) -> None:
        """``time_``: what time it is at the plant."""
        self._keeper, self._board, self._mapping, self._samples = keeper, board, mapping, samples
        self._time, self._seen = time_, 0
        self.missed = 0
        """Samples of the plant that came too fast to be read one by one."""
        self.ended = False
        """Whether the link was closed."""

    @property
    def now_s(self) -> float:
        """Process time of the last tick [s]."""
        return self._time.now_s

    def advance(self) -> Snapshot | None:
        """The next sample; None where none came in time, LinkError where there is no connection."""
        count, readings = self._board.wait(self._seen, WAIT_S)
        now_s = time.monotonic()
        if count <= self._seen:
            self._time.absent(now_s)
            if not self._keeper.up:
                raise LinkError(f"the plant is not reached: {self._keeper.trouble}")
            return None
        self.missed += count - self._seen - 1 if self._seen else 0
        self._seen = count
        if not readings:
            self._time.absent(now_s)
            return None
        told = readings.get(self._mapping.guard.time or "")
        told_s = float(told.value) if told is not None and isinstance(told.value, float | int) else None
        return self._samples.sample(self._time.sample(told_s, now_s), readings, now_s)


def finite_pace(pace: float) -> float:
    """``pace``; ValueError where it is not finite and above 0."""
    if not (math.isfinite(pace) and pace > 0.0):
        raise ValueError(f"pace {pace!r} must be finite and > 0 process seconds per wall-clock second")
    return pace
