"""A trace whose followers are told of everything, also of what finds no room on the disk."""

import threading
from collections import deque
from typing import Final, final

from homeostat.domain.ports import Kept
from homeostat.journal.events import Event, Subscriber, Trace
from homeostat.journal.listeners import Listeners

MOST_KEPT: Final = 10_000
"""Events that wait for room; what comes when there are so many is told and not stored."""


@final
class Followed:
    """Implements `homeostat.journal.events.Trace` over a journal: tells first, then stores.

    What cannot be stored because there is no room is kept and stored before everything that came after it, as soon as
    there is room. Whoever records learns of it by `Kept`, and does not record it again.
    """

    def __init__(self, journal: Trace, most: int = MOST_KEPT) -> None:
        """``journal`` stores; at most ``most`` events wait for it."""
        self._journal, self._most = journal, most
        self._listeners = Listeners()
        self._waiting: deque[tuple[Event, float]] = deque()
        self._ordering, self._storing = threading.Lock(), threading.Lock()
        self._lost = 0

    @property
    def missing(self) -> int:
        """Number of events that are not stored: those that wait for room, and those that there was no waiting for."""
        return len(self._waiting) + self._lost

    def record(self, event: Event, at_s: float) -> None:
        """Tell of ``event``, which happened at process time ``at_s`` [s], and append it to the journal.

        Raises Kept where there is no room and the event waits, ValueError where too many wait already; else as
        `homeostat.journal.events.Trace.record`.
        """
        with self._ordering:
            self._listeners.put(event, at_s)
            full = len(self._waiting) >= self._most
            if not full:
                self._waiting.append((event, at_s))
        self._listeners.tell()
        try:
            self._store(event)
        except Kept as kept:
            if not full:
                raise
            self._lost += 1
            raise ValueError(f"{self._most} events wait for room; one more is lost: {kept}") from kept

    def sync(self) -> None:
        """Return when everything that was recorded is on the disk; Kept where something waits for room."""
        self._store(None)
        self._journal.sync()

    def subscribe(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event, stored or not."""
        self._listeners.add(subscriber)

    def take_troubles(self) -> tuple[str, ...]:
        """What went wrong with subscribers since this was last asked, one line each."""
        return self._listeners.take_troubles()

    def _store(self, own: Event | None) -> None:
        """Append what waits, in order; what the journal refuses of ``own`` is raised, of another event told."""
        refusal: Exception | None = None
        with self._storing:
            while self._waiting:
                event, at_s = self._waiting[0]
                try:
                    self._journal.record(event, at_s)
                except OSError as error:
                    raise Kept(str(error)) from error
                except Exception as error:  # it cannot take this one, and will not later
                    if event is own:
                        refusal = error
                    else:
                        self._listeners.complain(f"event {event.kind!r}, {at_s:g} s, is not stored: {error}")
                self._waiting.popleft()
        if refusal is not None:
            raise refusal
