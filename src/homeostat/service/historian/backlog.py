"""What waits for the historian: bounded, and where there is no room samples go before alarms and events."""

from __future__ import annotations

from collections import deque
from typing import Final, final

from homeostat.history.samples import Batch
from homeostat.service.historian.messages import Kept

MOST: Final = 600
"""Most samples that wait, each of all tags: ten minutes of a plant that is sampled once per second."""
MOST_EVENTS: Final = 10_000
"""Most alarms and events that wait."""


@final
class Backlog:
    """Gives out what was kept in the order of its numbers."""

    def __init__(self) -> None:
        self._samples: deque[Kept] = deque()
        self._events: deque[Kept] = deque()
        self.lost_samples = 0
        """Samples for which there was no room."""
        self.lost_events = 0
        """Alarms and events for which there was no room although no sample was left."""

    def __len__(self) -> int:
        """How many wait."""
        return len(self._samples) + len(self._events)

    @property
    def lost(self) -> str:
        """How much was lost, in words; empty where nothing was."""
        counted = ((self.lost_samples, "sample"), (self.lost_events, "event"))
        return " and ".join(f"{n} {what}{'s' * (n != 1)}" for n, what in counted if n)

    def put(self, kept: Kept) -> None:
        """Have ``kept`` wait, whose number is the largest; the oldest sample goes where there is no room."""
        (self._samples if isinstance(kept.what, Batch) else self._events).append(kept)
        while self._samples and (len(self._samples) > MOST or len(self) > MOST_EVENTS):
            self._samples.popleft()
            self.lost_samples += 1
        while len(self._events) > MOST_EVENTS:
            self._events.popleft()
            self.lost_events += 1

    def take(self, number: int) -> None:
        """Everything up to ``number`` is kept for good, and waits no more."""
        for waiting in (self._samples, self._events):
            while waiting and waiting[0].number <= number:
                waiting.popleft()

    def after(self, number: int) -> Kept | None:
        """What follows behind ``number``; None where nothing does."""
        following = (
            next((kept for kept in waiting if kept.number > number), None) for waiting in (self._samples, self._events)
        )
        return min((kept for kept in following if kept is not None), key=lambda kept: kept.number, default=None)
