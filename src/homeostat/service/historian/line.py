"""The guard's end of the line to the historian: the guard waits for nothing, and what is not kept yet is sent again."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Listener
from pathlib import Path
from typing import Final, final

from homeostat.domain.observation import Message, Settled, Trouble
from homeostat.history.samples import Batch
from homeostat.history.store import Occurrence
from homeostat.service.historian.backlog import MOST, Backlog
from homeostat.service.historian.messages import LARGEST_BACK, Back, Kept, from_historian, to_historian
from homeostat.service.shared import Shared

AWAY_S: Final = 30.0
"""After so long without a historian that is an alarm, wall-clock [s]."""
AGAIN_S: Final = 0.2
"""Wait before a line that could let nobody in is tried again, wall-clock [s]."""
ALARM: Final = "history"
"""Alarm of a history that is not kept."""
LOST: Final = "history:lost"
"""Alarm of a history that has a gap."""


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
        self._waiting = Backlog()
        self._number, self._sent, self._loses = 0, 0, False
        self._connection: Shared | None = None
        self._gone_s, self._told, self._over = time.monotonic(), "", False
        for work in (self._listen, self._send_on):
            threading.Thread(target=work, name="historian's line", daemon=True).start()

    def keep(self, what: Batch | Occurrence) -> None:
        """Have ``what`` kept; returns at once."""
        with self._changed:
            before = self._waiting.lost
            self._number += 1
            self._waiting.put(Kept(self._number, what))
            if self._waiting.lost != before:
                self._lose()
            self._changed.notify_all()
        self._look()

    def miss(self) -> None:
        """A sample was lost before it came here."""
        with self._changed:
            self._waiting.lost_samples += 1
            self._lose()

    def _lose(self) -> None:
        """Raise the alarm of a gap; how large it is can be said once everything else is kept."""
        if not self._loses:
            text = f"the history has a gap: {MOST} samples wait for the historian, older ones are lost"
            self._loses = self._is_taken(Trouble(LOST, text))

    def _count(self) -> None:
        """The historian has caught up: say how much it has never seen, for a person to acknowledge."""
        if self._loses and not self._waiting:
            text = f"the history has a gap: {self._waiting.lost} since the guard began were lost"
            said = (Settled(LOST), Trouble(LOST, text), Settled(LOST))
            self._loses = not all(self._is_taken(message) for message in said)

    def _is_taken(self, message: Message) -> bool:
        """Whether the guard has taken ``message``; what it had no room for is said again at the next occasion."""
        return self._put(message) is not False

    def close(self, within_s: float) -> None:
        """Wait at most ``within_s`` [s] until everything is kept; nothing is taken any more."""
        with self._changed:
            self._changed.wait_for(lambda: not self._waiting or self._connection is None, within_s)
        self._over = True
        with contextlib.suppress(OSError):
            self._listener.close()
        if (connection := self._connection) is not None:
            connection.end()

    def _look(self) -> None:
        """Raise the alarm of a historian that is away for long."""
        away_s = 0.0 if self._connection is not None else time.monotonic() - self._gone_s
        if away_s > AWAY_S:
            self._tell(f"there has been no historian for {AWAY_S:g} s; nothing is kept")

    def _listen(self) -> None:
        while not self._over:
            try:
                connection = Shared(self._listener.accept())
            except OSError:
                time.sleep(AGAIN_S)  # too many files are open, perhaps
                continue
            with self._changed:
                self._connection = connection
                self._sent = 0
                self._changed.notify_all()
            self._hear(connection)
            with self._changed:
                self._gone_s, self._connection = time.monotonic(), None  # in this order: the guard looks unasked
                self._changed.notify_all()
            connection.close()

    def _hear(self, connection: Shared) -> None:
        """Take note of how far the historian has come, until it is gone, or says what nobody can take."""
        with contextlib.suppress(OSError, EOFError, ValueError, TypeError, OverflowError, RecursionError):
            while True:
                back = from_historian(connection.receive(LARGEST_BACK))
                self._taken(back)
                self._tell(back.trouble)

    def _taken(self, back: Back) -> None:
        with self._changed:
            self._waiting.take(back.taken)
            self._count()
            self._changed.notify_all()

    def _tell(self, trouble: str) -> None:
        """Raise the alarm, or have it return, where that is news."""
        if trouble != self._told and self._is_taken(Trouble(ALARM, trouble) if trouble else Settled(ALARM)):
            self._told = trouble

    def _send_on(self) -> None:
        while not self._over:
            with self._changed:
                self._changed.wait_for(lambda: self._over or self._owed is not None)
                connection, kept = self._connection, self._owed
                self._sent = self._sent if kept is None else kept.number
            if connection is not None and kept is not None:
                with contextlib.suppress(OSError):  # who listens finds out
                    connection.send(to_historian(kept))

    @property
    def _owed(self) -> Kept | None:
        """The next that was not sent over this connection; None where there is none, or nothing is left to send."""
        return None if self._connection is None else self._waiting.after(self._sent)
