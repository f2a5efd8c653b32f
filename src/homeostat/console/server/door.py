"""The way in to the port: room for some connections, which those keep whose people are known; and a short log."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import os
import resource
import socket
import time
from collections import Counter
from collections.abc import Callable
from typing import Any, Final, final

from uvicorn.protocols.http.h11_impl import H11Protocol

MOST: Final = 256
"""Most connections; fewer where the process may open few files, which the rest of it needs as well."""
FEWEST: Final = 16
"""Most connections where it may open very few."""
HEAD_S: Final = 10.0
"""Longest time from one answer, or from the beginning, to the end of the next request's head, wall-clock [s]."""
LINES: Final = 20
"""Most lines of a minute that the server says of what others send it."""
_MINUTE_S: Final = 60.0


def room() -> int:
    """Most connections of this process: a quarter of the files that it may open."""
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    return MOST if files == resource.RLIM_INFINITY else max(FEWEST, min(MOST, files // 4))


@final
class Door(socket.socket):
    """A listening socket that closes connections when there are too many.

    First go those of the address that has the most, the oldest first, whose people are not known: whoever opens many
    and says nothing loses them to whoever comes and says who they are.
    """

    def __init__(self, family: int, most: int | None = None) -> None:
        """``most``: connections that there is room for, shared with nobody; None for what the process affords."""
        super().__init__(family, socket.SOCK_STREAM)
        self._most = room() if most is None else most
        self._held: dict[tuple[str, int], _Line] = {}
        self._known: dict[tuple[str, int], str] = {}
        self._spare = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)

    @property
    def held(self) -> int:
        """How many connections there are."""
        return len(self._held)

    def know(self, client: tuple[str, int], who: str) -> None:
        """The connection from ``client`` is used by ``who``, of whom a quarter of the room is kept at most."""
        if client in self._held and list(self._known.values()).count(who) < max(1, self._most // 4):
            self._known[client] = who

    def accept(self) -> tuple[socket.socket, Any]:
        """The next connection; ConnectionAbortedError where it cannot be kept."""
        try:
            found, address = super().accept()
        except OSError as error:
            if error.errno not in (errno.EMFILE, errno.ENFILE) or self._spare < 0:
                raise
            self._turn_away()
            raise ConnectionAbortedError from None
        client = address[:2]
        if len(self._held) >= self._most and not self._make_room():
            found.close()
            raise ConnectionAbortedError
        line = _Line(found, lambda: self._gone(client, line))
        self._held[client] = line
        return line, address

    def close(self) -> None:
        """Listen no more."""
        if self._spare >= 0:
            os.close(self._spare)
            self._spare = -1
        super().close()

    def _make_room(self) -> bool:
        """End a connection of nobody who is known; whether there was one."""
        strange = [client for client in self._held if client not in self._known]
        if not strange:
            return False
        many = Counter(host for host, _ in self._held).most_common()
        hosts = {host for host, _ in strange}
        host = next(host for host, _ in many if host in hosts)
        first = next(client for client in strange if client[0] == host)
        line = self._held.pop(first)
        with contextlib.suppress(OSError):  # it may be over already
            line.shutdown(socket.SHUT_RDWR)  # who reads or writes it learns that it is over, and closes it
        return True

    def _gone(self, client: tuple[str, int], line: _Line) -> None:
        if self._held.get(client) is line:
            del self._held[client]
            self._known.pop(client, None)

    def _turn_away(self) -> None:
        """Close a connection that waits, where no file can be opened for it: it would wait, and be told of, forever."""
        os.close(self._spare)
        self._spare = -1
        with contextlib.suppress(OSError):  # it may be gone, or others have opened a file meanwhile
            super().accept()[0].close()
        with contextlib.suppress(OSError):
            self._spare = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)


@final
class _Line(socket.socket):
    """A connection that tells when it is closed."""

    def __init__(self, found: socket.socket, closed: Callable[[], None]) -> None:
        super().__init__(found.family, found.type, found.proto, found.detach())
        self._told = closed

    def close(self) -> None:
        super().close()
        self._told()


class Punctual(H11Protocol):
    """Speaks HTTP with whoever gets to the end of a request's head in time."""

    _late: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Somebody has come."""
        super().connection_made(transport)
        self._await_head()

    def on_response_complete(self) -> None:
        """An answer was given."""
        super().on_response_complete()
        self._await_head()

    def connection_lost(self, exc: Exception | None) -> None:
        """Somebody has gone."""
        if self._late is not None:
            self._late.cancel()
        super().connection_lost(exc)

    def _await_head(self) -> None:
        if self._late is not None:
            self._late.cancel()
        self._late = self.loop.call_later(HEAD_S, self._end)

    def _end(self) -> None:
        if self.cycle is None or self.cycle.response_complete:
            self.transport.close()


@final
class Sparing(logging.Filter):
    """Lets so many lines of a minute through, and says how many there were."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """``clock`` tells seconds and is set by nobody."""
        super().__init__()
        self._clock = clock
        self._begun, self._said, self._left = clock(), 0, 0

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether ``record`` is said."""
        now = self._clock()
        if now - self._begun >= _MINUTE_S:
            if self._left:
                record.msg, record.args = f"{record.getMessage()} ({self._left} more were left out)", ()
            self._begun, self._said, self._left = now, 0, 0
        self._said += 1
        self._left += self._said > LINES
        return self._said <= LINES
