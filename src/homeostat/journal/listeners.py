"""Whoever follows a trace: told in order, one event at a time, and never able to harm the record."""

import threading
from collections import deque
from typing import final

from homeostat.journal.events import Event, Subscriber

MOST_UNTOLD = 10_000
"""Events that wait while a subscriber hangs; older ones are dropped, which is a trouble."""
MOST_TROUBLES = 100
"""Troubles that are kept until somebody takes them; older ones are dropped."""


@final
class Listeners:
    """The subscribers of a trace and what went wrong with them.

    One thread tells at a time and in the order of the lines; another one that records meanwhile does not wait. So a
    subscriber may record, and one that hangs holds up only the thread that tells it.
    """

    def __init__(self) -> None:
        self._subscribers: list[Subscriber] = []
        self._untold: deque[tuple[Event, float]] = deque()
        self._telling = threading.Lock()
        self._troubles: deque[str] = deque(maxlen=MOST_TROUBLES)

    def add(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event."""
        self._subscribers.append(subscriber)

    def put(self, event: Event, at_s: float) -> None:
        """Keep ``event``, which happened at ``at_s`` [s], to be told; called in the order of the lines."""
        if not self._subscribers:
            return
        if len(self._untold) >= MOST_UNTOLD:
            self._untold.popleft()
            self.complain(f"a subscriber is {MOST_UNTOLD} events behind and misses the oldest; look why it hangs")
        self._untold.append((event, at_s))

    def tell(self) -> None:
        """Tell what waits, unless another thread is doing so: that one goes on until nothing waits."""
        while self._untold and self._telling.acquire(blocking=False):
            try:
                self._tell_all()
            finally:
                self._telling.release()

    def complain(self, trouble: str) -> None:
        """Keep one line on what went wrong."""
        if not self._troubles or self._troubles[-1] != trouble:
            self._troubles.append(trouble)

    def take_troubles(self) -> tuple[str, ...]:
        """What went wrong since this was last asked, one line each."""
        taken: list[str] = []
        while self._troubles:
            taken.append(self._troubles.popleft())
        return tuple(taken)

    def _tell_all(self) -> None:
        while self._untold:
            event, at_s = self._untold.popleft()
            for subscriber in self._subscribers:
                try:
                    subscriber(event, at_s)
                except Exception as error:
                    words = " ".join(f"{type(error).__name__}: {error}".split())
                    self.complain(f"a subscriber failed at event {event.kind!r}, {at_s:g} s: {words}")
