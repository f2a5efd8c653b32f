"""The mailbox: how anybody asks the guard for anything; putting never blocks, and what is put cannot change after."""

import threading
from collections import deque

from homeostat.domain.mode import PersonCommand
from homeostat.domain.observation import Message, Settled, StandBack, Trouble

MOST = 1000
"""Most messages that wait; what comes when it is full is turned away."""
APART = 100
"""Places beyond those, for people's orders and for alarms each: whoever asks too much silences neither."""


class Mailbox:
    """A bounded queue between any number of threads that ask and the one that decides."""

    def __init__(self, most: int = MOST) -> None:
        """``most``: messages that may wait beside those that have places apart."""
        self._waiting: deque[Message] = deque()
        self._shared, self._orders, self._alarms = 0, 0, 0
        self._lost: StandBack | None = None
        self._most = most
        self._lock = threading.Lock()

    def put(self, message: Message) -> bool:
        """Leave ``message``; False where the mailbox is full, and nothing was taken.

        A :class:`StandBack` has a place of its own, which nobody else fills; of several that wait the last one counts.
        """
        with self._lock:
            if isinstance(message, StandBack):
                self._lost = message
                return True
            if not self._has_place(message):
                return False
            self._waiting.append(message)
            return True

    def _has_place(self, message: Message) -> bool:
        """Take a place for ``message``, one apart if it may: whether there was any."""
        if isinstance(message, PersonCommand) and self._orders < APART:
            self._orders += 1
        elif isinstance(message, Trouble | Settled) and self._alarms < APART:
            self._alarms += 1
        elif self._shared < self._most:
            self._shared += 1
        else:
            return False
        return True

    def stand_back(self) -> StandBack | None:
        """Why the guard must observe, where that was said since the last call."""
        with self._lock:
            lost, self._lost = self._lost, None
        return lost

    def take(self) -> tuple[Message, ...]:
        """Everything else that waits, the oldest first."""
        with self._lock:
            taken = tuple(self._waiting)
            self._waiting.clear()
            self._shared, self._orders, self._alarms = 0, 0, 0
            return taken
