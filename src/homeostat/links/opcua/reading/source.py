"""The reading side of an OPC UA link: one sample per tick, as the plant's counter goes on."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Final, final

from homeostat.links.errors import LinkError
from homeostat.links.opcua.connection.board import QUEUE, Board, NodeReading
from homeostat.links.opcua.connection.keeper import Keeper
from homeostat.links.opcua.mapping import LinkMapping
from homeostat.links.opcua.reading.node_sample import NodeSample
from homeostat.links.opcua.reading.process_time import ProcessTime
from homeostat.links.opcua.reading.samples import Samples

WAIT_S = 0.4
"""Longest wait for a new sample, wall-clock [s]: the guard's tick waits a little longer."""

_SEVERITY_SHIFT: Final = 30
"""The two highest bits of a status are its severity."""


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
        self._tick_s, self._pace = time_.tick_s, time_.pace
        self._counted: float | None = None
        self._counted_s, self._skipped = 0.0, 0
        self.missed = 0
        """Samples that the plant has counted and nobody has read: not sent, too many at once, or lost on the way."""
        self.ended = False
        """Whether the link was closed."""

    @property
    def now_s(self) -> float:
        """Process time of the last tick [s]."""
        return self._time.now_s

    def advance(self) -> NodeSample | None:
        """The next sample; None where none came in time, LinkError where there is no connection."""
        end_s = time.monotonic() + WAIT_S
        while True:
            count, readings = self._board.wait(self._seen, max(end_s - time.monotonic(), 0.0))
            now_s = time.monotonic()
            if count <= self._seen:
                self._time.absent(now_s)
                if not self._keeper.up:
                    raise LinkError(f"the plant is not reached: {self._keeper.trouble}")
                return None
            self._skipped += count - self._seen - 1 if self._seen else 0
            self._seen = count
            if (sample := self._sampled(readings, now_s)) is not None:
                return sample

    def skip(self) -> None:
        """Leave out the samples that have waited so far but for the newest: nobody was there to read them."""
        self._board.skip()

    def _sampled(self, readings: Mapping[str, NodeReading], now_s: float) -> NodeSample | None:
        """The sample that ``readings`` are at ``now_s`` of our monotonic clock [s]; None where its tick was there."""
        guard, told_s = self._mapping.guard, _number(readings.get(self._mapping.guard.time or ""))
        waiting = self._board.waiting
        if not readings or (waiting and self._time.passed(told_s)):
            return None
        at_s = self._time.sample(told_s, now_s, waiting)
        if at_s is None:
            return None
        counted = told_s / self._tick_s if guard.counter is None and told_s is not None else None
        if guard.counter is not None:
            counted = _number(readings.get(guard.counter))
        self.missed += self._missing(counted, now_s)
        return self._samples.sample(at_s, readings, now_s)

    def _missing(self, counted: float | None, now_s: float) -> int:
        """Samples between the last one and that which the plant has ``counted``; no matter how many have come.

        A counter that ran back, or further than samples can have come, belongs to a plant that began again.
        """
        before, since_s, skipped = self._counted, now_s - self._counted_s, self._skipped
        self._counted, self._counted_s, self._skipped = counted, now_s, 0
        if counted is None or before is None:
            return skipped
        gap = round(counted - before) - 1
        return max(gap if gap <= QUEUE * (1.0 + since_s * self._pace / self._tick_s) else 0, skipped)


def _number(reading: NodeReading | None) -> float | None:
    """What ``reading`` says, None where it is bad or no finite number."""
    if reading is None or reading.status >> _SEVERITY_SHIFT == 2 or not isinstance(reading.value, float | int):
        return None
    return float(reading.value) if math.isfinite(reading.value) else None


def finite_pace(pace: float) -> float:
    """``pace``; ValueError where it is not finite and above 0."""
    if not (math.isfinite(pace) and pace > 0.0):
        raise ValueError(f"pace {pace!r} must be finite and > 0 process seconds per wall-clock second")
    return pace
