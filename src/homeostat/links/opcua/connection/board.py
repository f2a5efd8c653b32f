"""The board: what the server has said last of each node, shared between the connection's thread and whoever reads."""

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import TypeAlias

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


class Board:
    """The last reading of each node; a batch of them is put at once."""

    def __init__(self, pulse: str | None) -> None:
        """``pulse``: address of the node that says that there is a new sample; any batch does, where None."""
        self._pulse = pulse
        self._changed = threading.Condition()
        self._readings: dict[str, NodeReading] = {}
        self._samples, self._pulse_s, self._clock_s = 0, -1e9, 0.0

    def put(self, batch: Mapping[str, NodeReading]) -> None:
        """Take note of ``batch``, address -> reading."""
        with self._changed:
            before = self._readings.get(self._pulse) if self._pulse else None
            self._readings.update(batch)
            now = batch.get(self._pulse) if self._pulse else None
            changed = before is not None and now is not None and now.value != before.value  # one look is no pulse
            new = bool(batch) if self._pulse is None else changed
            if new:
                self._samples += 1
                self._pulse_s = time.monotonic()
                self._clock_s = _clock_difference(now or next(iter(batch.values())), self._clock_s)
            self._changed.notify_all()

    def clear(self) -> None:
        """Forget everything: the connection that said it is gone."""
        with self._changed:
            self._readings.clear()
            self._changed.notify_all()

    @property
    def age_s(self) -> float:
        """Since when there is no new sample, wall-clock [s]."""
        with self._changed:
            return time.monotonic() - self._pulse_s

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
        """As :meth:`readings`, once there were more than ``after`` samples, or after ``within_s`` [s]."""
        with self._changed:
            self._changed.wait_for(lambda: self._samples > after, within_s)
            return self._samples, dict(self._readings)


def _clock_difference(reading: NodeReading, before_s: float) -> float:
    at = reading.server_at or reading.source_at
    return before_s if at is None else (at - reading.received_at).total_seconds()
