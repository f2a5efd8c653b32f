"""The board: what the server has said last of each node, shared between the connection's thread and whoever reads."""

import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Final, TypeAlias

QUEUE: Final = 10
"""Most samples that wait for whoever reads them, and most values of a node that a server keeps until it sends them."""

Raw: TypeAlias = float | int | bool | str | None
"""What a node can hold here; None for anything else, and for nothing."""


@dataclass(frozen=True, slots=True)
class NodeReading:
    """What the server has said of one node."""

    value: Raw
    """Its value."""
    status: int
    """OPC UA status code with its sub-code (Part 8): the two highest bits are 0 good, 1 uncertain, 2 bad."""
    source_at: datetime | None
    """When the source took it, by the source's clock (UTC)."""
    server_at: datetime | None
    """When the server had it, by the server's clock (UTC)."""
    received_s: float
    """When it came, by our monotonic clock [s]."""
    received_at: datetime
    """When it came, by our clock (UTC)."""
    changed_s: float = 0.0
    """When value, status or source time were other ones last, by our monotonic clock [s]; the board knows it."""

    def says(self, other: "NodeReading") -> bool:
        """Whether ``other`` has the same value, status and source time: a node that is only read again."""
        same = self.value == other.value or (self.value != self.value and other.value != other.value)
        return same and self.status == other.status and self.source_at == other.source_at


class Board:
    """The last reading of each node; a batch of them is put at once."""

    def __init__(self, pulse: str | None, period_s: float = 1.0) -> None:
        """``pulse``: address of the node that says that there is a new sample.

        Where it is None, whatever came since the last sample is one, every ``period_s`` of the monotonic clock [s].
        """
        self._pulse, self._period_s = pulse, period_s
        self._changed = threading.Condition()
        self._readings: dict[str, NodeReading] = {}
        self._earlier: dict[str, NodeReading] = {}
        self._waiting: deque[tuple[int, dict[str, NodeReading]]] = deque(maxlen=QUEUE)
        self._samples, self._pulse_s, self._clock_s = 0, -1e9, 0.0
        self._unread, self._due_s = False, -1e9

    def put(self, batch: Mapping[str, NodeReading]) -> None:
        """Take note of ``batch``, address -> reading."""
        with self._changed:
            before = self._readings.get(self._pulse) if self._pulse else None
            self._readings.update({node: self._dated(node, reading) for node, reading in batch.items()})
            now = batch.get(self._pulse) if self._pulse else None
            changed = before is not None and now is not None and now.value != before.value  # one look is no pulse
            if bool(batch) if self._pulse is None else changed:
                self._pulse_s = time.monotonic()
                self._clock_s = _clock_difference([now] if now else list(batch.values()), self._clock_s)
                self._unread = True
                if self._pulse is not None:
                    self._sample()
            self._changed.notify_all()

    def clear(self) -> None:
        """Forget everything but when it changed: the connection that said it is gone."""
        with self._changed:
            self._earlier |= self._readings
            self._readings.clear()
            self._waiting.clear()
            self._unread = False
            self._changed.notify_all()

    def skip(self) -> None:
        """Let the newest sample alone wait."""
        with self._changed:
            while len(self._waiting) > 1:
                self._waiting.popleft()

    def _dated(self, node: str, reading: NodeReading) -> NodeReading:
        """``reading`` with the time since when its node says so, also over connections."""
        before = self._readings.get(node) or self._earlier.pop(node, None)
        same = before is not None and before.says(reading)
        return replace(reading, changed_s=before.changed_s if same and before else reading.received_s)

    def _sample(self) -> None:
        self._samples, self._unread = self._samples + 1, False
        self._waiting.append((self._samples, dict(self._readings)))

    def _due(self) -> float:
        """How long to wait for a sample at most [s]; without a pulse one is taken as soon as it is time to."""
        if self._pulse is not None or not self._unread:
            return float("inf")
        now_s = time.monotonic()
        if now_s < self._due_s:
            return self._due_s - now_s
        late = now_s - self._due_s > self._period_s
        self._due_s = (now_s if late else self._due_s) + self._period_s
        self._sample()
        return 0.0

    @property
    def age_s(self) -> float:
        """Since when there is no new sample, wall-clock [s]."""
        with self._changed:
            return time.monotonic() - self._pulse_s

    @property
    def waiting(self) -> int:
        """How many samples wait to be read."""
        with self._changed:
            return len(self._waiting)

    @property
    def clock_s(self) -> float:
        """How far the server's clock is ahead of ours, with the way of the sample [s]."""
        with self._changed:
            return self._clock_s

    def readings(self) -> tuple[int, dict[str, NodeReading]]:
        """How many samples there were, and the last reading of each node."""
        with self._changed:
            return self._samples, dict(self._readings)

    def get(self, address: str | None) -> NodeReading | None:
        """The last reading of one node; None where there is none."""
        with self._changed:
            return None if address is None else self._readings.get(address)

    def wait(self, after: int, within_s: float) -> tuple[int, dict[str, NodeReading]]:
        """The first sample after number ``after``, with its number, as long as it waits; none within ``within_s`` [s].

        Where there is none, the number of the last one, and whatever was said last of each node.
        """
        end = time.monotonic() + within_s
        with self._changed:
            while self._samples <= after:
                due_s, left_s = self._due(), end - time.monotonic()
                if self._samples > after or left_s <= 0.0:
                    break
                self._changed.wait(min(due_s, left_s))
            while self._waiting:
                number, readings = self._waiting.popleft()
                if number > after:
                    return number, readings
            return self._samples, dict(self._readings)


def _clock_difference(readings: list[NodeReading], before_s: float) -> float:
    """By how much the newest of ``readings`` is ahead of when it came [s]; ``before_s`` where none has a time."""
    said = [(at - r.received_at).total_seconds() for r in readings if (at := r.server_at or r.source_at) is not None]
    return max(said, default=before_s)
