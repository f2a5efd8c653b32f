"""A trace that lives in memory: for tests, notebooks and callers who want no files."""

import threading
from collections import deque
from dataclasses import dataclass
from typing import TypeVar, final

from homeostat.journal.chain import Chain
from homeostat.journal.events import Event, Subscriber
from homeostat.journal.listeners import Listeners
from homeostat.journal.reading import Record, parse

E = TypeVar("E")


@dataclass(frozen=True, slots=True)
class Entry:
    """One recorded event."""

    at_s: float
    """Process time at which it happened [s]."""
    event: Event
    """What happened."""


@final
class MemoryTrace:
    """Keeps every event as it is and, next to it, the line that a journal would hold."""

    def __init__(self, most: int | None = None) -> None:
        """``most``: number of the latest events that are kept; all of them where None."""
        self._chain = Chain()
        self._kept: deque[tuple[Entry, bytes]] = deque(maxlen=most)
        self._listeners = Listeners()
        self._lock = threading.Lock()

    def record(self, event: Event, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]; see `homeostat.journal.events.Trace`."""
        with self._lock:
            line = self._chain.draft(event, at_s)
            self._chain.commit(line, at_s)
            self._kept.append((Entry(at_s, event), line))
            self._listeners.put(event, at_s)
        self._listeners.tell()

    def sync(self) -> None:
        """Nothing: what is in memory is not safe from a power cut."""

    def subscribe(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event."""
        self._listeners.add(subscriber)

    def take_troubles(self) -> tuple[str, ...]:
        """What went wrong with subscribers since this was last asked, one line each."""
        return self._listeners.take_troubles()

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All events that are kept, with their times, in order."""
        return tuple(entry for entry, _ in self._snapshot())

    def of(self, event_class: type[E]) -> tuple[E, ...]:
        """All events of one class that are kept, in order."""
        return tuple(entry.event for entry, _ in self._snapshot() if isinstance(entry.event, event_class))

    def records(self) -> tuple[Record, ...]:
        """The events that are kept as a reader of the journal would see them."""
        return tuple(parse(line) for _, line in self._snapshot())

    @property
    def last(self) -> str:
        """Digest of the last line; the same for two runs exactly when they recorded the same."""
        return self._chain.last

    def _snapshot(self) -> tuple[tuple[Entry, bytes], ...]:
        with self._lock:
            return tuple(self._kept)
