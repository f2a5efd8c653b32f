"""A trace that lives in memory: for tests, notebooks and callers who want no files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar, final

from homeostat.trace.chain import Chain
from homeostat.trace.events import Event, Subscriber
from homeostat.trace.replay import Record, parse

E = TypeVar("E")


@dataclass(frozen=True, slots=True)
class Entry:
    """One recorded event."""

    at_s: float
    """Process time [s]."""
    event: Event
    """What happened."""


@final
class MemoryTrace:
    """Keeps every event as it is and, next to it, the line that a journal would hold."""

    def __init__(self) -> None:
        self._chain = Chain()
        self._entries: list[Entry] = []
        self._lines: list[bytes] = []
        self._subscribers: list[Subscriber] = []

    def record(self, event: Event, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]; see `homeostat.trace.events.Trace`."""
        line = self._chain.draft(event, at_s)
        self._chain.commit(line)
        self._entries.append(Entry(at_s, event))
        self._lines.append(line)
        for subscriber in self._subscribers:
            subscriber(event, at_s)

    def subscribe(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event."""
        self._subscribers.append(subscriber)

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All events with their times, in order."""
        return tuple(self._entries)

    def of(self, event_class: type[E]) -> tuple[E, ...]:
        """All events of one class, in order."""
        return tuple(entry.event for entry in self._entries if isinstance(entry.event, event_class))

    def records(self) -> tuple[Record, ...]:
        """The events as a reader of the journal would see them."""
        return tuple(parse(line) for line in self._lines)

    @property
    def last(self) -> str:
        """Digest of the last line; the same for two runs exactly when they recorded the same."""
        return self._chain.last
