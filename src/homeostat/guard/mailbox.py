"""The mailbox: how anybody asks the guard for anything; putting never blocks, and what is put cannot change after."""

import threading
from collections import deque

from homeostat.domain.mode import PersonCommand
from homeostat.domain.observation import Message, StandBack

MOST = 1000
"""Most messages that wait; what comes when it is full is turned away."""
ORDERS = 100
"""Places beyond those, which only people's orders get: whoever asks too much keeps no person from being heard."""


class Mailbox:
    """A bounded queue between any number of threads that ask and the one that decides."""

    def __init__(self, most: int = MOST) -> None:
        """``most``: messages that may wait, people's orders apart."""
        self._waiting: deque[Message] = deque()
        self._lost: StandBack | None = None
        self._most = most
        self._lock = threading.Lock()

    def put(self, message: Message) -> bool:
        """Leave ``message``; False where the mailbox is full, and nothing was taken.

        A :class:`StandBack` has a place of its own, which nobody else fills; of several that wait the last one counts.
        """
        most = self._most + (ORDERS if isinstance(message, PersonCommand) else 0)
        with self._lock:
            if isinstance(message, StandBack):
                self._lost = message
                return True
            if len(self._waiting) >= most:
                return False
            self._waiting.append(message)
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
            return taken
