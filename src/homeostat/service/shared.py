"""A connection that one thread reads and others write: any of them ends it for all, and nobody closes it under another.

A descriptor that is closed while another thread is about to write by it may be a file's by then.
"""

from __future__ import annotations

import contextlib
import os
import socket
import threading
from multiprocessing.connection import Connection
from typing import final


@final
class Shared:
    """A local stream; whoever reads it closes it."""

    def __init__(self, connection: Connection) -> None:
        """OSError where ``connection`` is closed already."""
        self._connection, self._sending = connection, threading.Lock()
        self._end = socket.socket(fileno=os.dup(connection.fileno()))

    def send(self, frame: bytes) -> None:
        """Send ``frame``, from any thread; OSError where the connection is at its end."""
        with self._sending:
            self._connection.send_bytes(frame)

    def receive(self, most: int) -> bytes:
        """The next frame, for the one thread that reads; OSError, EOFError at the end, or beyond ``most`` bytes."""
        return self._connection.recv_bytes(most)

    def end(self) -> None:
        """Have whoever reads or writes see the end, from any thread."""
        with contextlib.suppress(OSError):
            self._end.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End it and, once nobody writes any more, close it; for the thread that reads."""
        self.end()
        with self._sending, contextlib.suppress(OSError):
            self._connection.close()
        self._end.close()
