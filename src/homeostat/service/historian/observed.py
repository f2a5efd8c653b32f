"""What a tick of the guard and the link beneath it give a history: each tag's value, with status code and times."""

from __future__ import annotations

import math
import time
from datetime import datetime
from typing import Final, final

import numpy as np

from homeostat.history.quality import BAD, GOOD, UNCERTAIN
from homeostat.history.samples import NO_TIME, Batch
from homeostat.links.opcua.mapping import LinkMapping
from homeostat.links.opcua.reading.node_sample import NodeSample

PROCESS_TIME: Final = "process time"
"""Name under which the process time of each sample is kept [s]: a plant in scaled time is read by it."""
WRONG_TYPE: Final = 0x80890000
"""Status of a node that is good and holds nothing that can be read: a configuration error."""


@final
class Observed:
    """Makes one batch of each sample.

    A node that has not changed has the value that it had: such a sample has the time at which the server showed that
    the plant goes on, and not that of the last change again.
    """

    def __init__(self, mapping: LinkMapping) -> None:
        self._mapping = mapping
        self._tags = (*mapping.tags, PROCESS_TIME)
        self._pulse = mapping.guard.counter or mapping.guard.time
        self._last: dict[str, int] = {}

    def batch(self, sample: NodeSample) -> Batch:
        """``sample``, as its nodes showed it."""
        own_us = time.time_ns() // 1000
        pulse = sample.readings.get(self._pulse or "")
        now_us = _us(None if pulse is None else pulse.source_at, own_us)
        rows = [self._row(tag, nodes.node, sample, now_us) for tag, nodes in self._mapping.tags.items()]
        rows.append((now_us, sample.at_s, GOOD, NO_TIME))
        times, values, codes, servers = zip(*rows, strict=True)
        return Batch(
            self._tags,
            np.array(times, dtype=np.int64),
            np.array(values, dtype=np.float64),
            np.array(codes, dtype=np.uint32),
            np.array(servers, dtype=np.int64),
            own_us,
        )

    def _row(self, tag: str, node: str, sample: NodeSample, now_us: int) -> tuple[int, float, int, int]:
        """Source time [us], value in the tag's unit, status code and server time [us] of ``tag``."""
        value, reading = sample.values.get(tag, math.nan), sample.readings.get(node)
        if reading is None:
            return now_us, value, BAD, NO_TIME
        at_us = _us(reading.source_at, now_us)
        if at_us <= self._last.get(tag, NO_TIME):
            at_us = max(now_us, at_us)
        self._last[tag] = at_us
        code = reading.status
        if code >> 30 == 0 and tag in sample.bad:
            code = WRONG_TYPE
        elif code >> 30 == 0 and tag in sample.uncertain:
            code = UNCERTAIN
        return at_us, value, code, _us(reading.server_at, NO_TIME)


def _us(at: datetime | None, otherwise: int) -> int:
    return otherwise if at is None else round(at.timestamp() * 1e6)
