"""The guard's end of the line to the historian: the guard waits for nothing, and what is not kept yet is sent again."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection, Listener
from pathlib import Path
from typing import Final, final

from homeostat.domain.observation import Message, Settled, Trouble
from homeostat.history.samples import Batch
from homeostat.history.store import Occurrence
from homeostat.service.historian.messages import LARGEST_BACK, Back, Kept, from_historian, to_historian

MOST: Final = 600
"""Most that waits to be kept: what is older is lost where the historian is away for longer."""
AWAY_S: Final = 30.0
"""After so long without a historian that is an alarm, wall-clock [s]."""
ALARM: Final = "history"
"""Alarm of a history that is not kept."""


@final
class HistoryLine:
    """Lets one historian in at a time, in threads of its own, and keeps what it has not taken."""

    def __init__(self, path: Path, put: Callable[[Message], object]) -> None:
        """Listen at ``path``; ``put`` takes the alarm. OSError where the socket cannot be made."""
        self._put = put
        path.unlink(missing_ok=True)
        before = os.umask(0o177)
        try:
            self._listener = Listener(str(path), family="AF_UNIX", backlog=1)
        finally:
            os.umask(before)
        self._changed = threading.Condition()
        self._waiting: deque[Kept] = deque()
        self._number, self._sent, self._lost = 0, 0, 0
        self._connection: Connection | None = None
        self._gone_s, self._told, self._over = time.monotonic(), "", False
        for work in (self._listen, self._send_on):
            threading.Thread(target=work, name="historian's line", daemon=True).start()

    @property
    def lost(self) -> int:
        """Batches and events that no historian took in time."""
        return self._lost

    def keep(self, what: Batch | Occurrence) -> None:
        """Have ``what`` kept; returns at once."""
        with self._changed:
            self._number += 1
            self._waiting.append(Kept(self._number, what))
            while len(self._waiting) > MOST:
                self._lost += 1
                self._waiting.popleft()
            self._changed.notify_all()
        self._look()

    def close(self, within_s: float) -> None:
        """Wait at most ``within_s`` [s] until everything is kept; nothing is taken any more."""
        with self._changed:
            self._changed.wait_for(lambda: not self._waiting or self._connection is None, within_s)
        self._over = True
        with contextlib.suppress(OSError):
            self._listener.close()
        if (connection := self._connection) is not None:
            with contextlib.suppress(OSError):
                connection.close()

    def _look(self) -> None:
        """Raise the alarm of a historian that is away for long."""
        away_s = 0.0 if self._connection is not None else time.monotonic() - self._gone_s
        if away_s > AWAY_S:
            self._tell(f"there has been no historian for {AWAY_S:g} s; nothing is kept")

    def _listen(self) -> None:
        while not self._over:
            try:
                connection: Connection = self._listener.accept()
            except OSError:
                continue
            with self._changed:
                self._connection = connection
                self._sent = self._waiting[0].number - 1 if self._waiting else self._number
                self._changed.notify_all()
            self._hear(connection)
            with self._changed:
                self._gone_s, self._connection = time.monotonic(), None  # in this order: the guard looks unasked
                self._changed.notify_all()
            with contextlib.suppress(OSError):
                connection.close()

    def _hear(self, connection: Connection) -> None:
        """Take note of how far the historian has come, until it is gone."""
        with contextlib.suppress(OSError, EOFError, ValueError, TypeError):
            while True:
                back = from_historian(connection.recv_bytes(LARGEST_BACK))
                self._taken(back)
                self._tell(back.trouble)

    def _taken(self, back: Back) -> None:
        with self._changed:
            while self._waiting and self._waiting[0].number <= back.taken:
                self._waiting.popleft()
            self._changed.notify_all()

    def _tell(self, trouble: str) -> None:
        """Raise the alarm, or have it return, where that is news."""
        if trouble != self._told:
            self._told = trouble
            self._put(Trouble(ALARM, trouble) if trouble else Settled(ALARM))

    def _send_on(self) -> None:
        while not self._over:
            with self._changed:
                self._changed.wait_for(lambda: self._owed or self._over)
                connection, kept = self._connection, self._following()
            if connection is not None and kept is not None:
                with contextlib.suppress(OSError):  # who listens finds out
                    connection.send_bytes(to_historian(kept))

    @property
    def _owed(self) -> bool:
        return self._connection is not None and bool(self._waiting) and self._waiting[-1].number > self._sent

    def _following(self) -> Kept | None:
        """The next that was not sent over this connection."""
        for kept in self._waiting:
            if kept.number > self._sent:
                self._sent = kept.number
                return kept
        return None
