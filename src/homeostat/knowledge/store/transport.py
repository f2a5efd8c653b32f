"""One HTTP exchange, bounded in time and size, that never leaves the host it was meant for."""

from __future__ import annotations

import contextlib
import http.client
import socket
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final
from urllib.parse import SplitResult, urljoin, urlsplit

from homeostat.knowledge.store.store import StoreUnavailable

_MOST_REDIRECTS: Final = 3
_REPEATABLE: Final = {301: ("GET",), 302: ("GET",), 303: ("GET",), 307: ("GET", "POST"), 308: ("GET", "POST")}
"""Status of a redirect, and the methods that may be repeated at the new place with the same body."""


@dataclass(frozen=True, slots=True)
class Reply:
    """What came back."""

    status: int
    """HTTP status code."""
    media_type: str
    """Media type without parameters, in lower case."""
    body: bytes
    """The body as sent, at most as long as asked for."""
    location: str
    """Where a redirect points; empty otherwise."""


@dataclass(frozen=True, slots=True)
class Transport:
    """How requests are sent. Each opens its own connection, so one object serves many threads; proxies are not used."""

    timeout_s: float = 30.0
    """Longest time from the start of a request to the last byte of its reply, in seconds."""
    max_bytes: int = 256 * 1024 * 1024
    """Longest reply that is read, in bytes."""

    def send(self, method: str, url: str, headers: Mapping[str, str], body: bytes | None = None) -> Reply:
        """Send a request and read the reply, whatever its status; redirects on the same host are followed.

        Raises StoreUnavailable where no complete reply came in time, it was too long, or it pointed to another host.
        """
        for _ in range(_MOST_REDIRECTS + 1):
            reply = self._exchange(method, url, headers, body)
            if reply.status not in _REPEATABLE or not reply.location:
                return reply
            target = urljoin(url, reply.location)
            if origin(target) != origin(url) or method not in _REPEATABLE[reply.status]:
                raise StoreUnavailable(
                    f"store at {plain(url)} redirects a {method} to {plain(target)} (status {reply.status}), which is "
                    "not followed; configure that address if it is the right one"
                )
            url = target
        raise StoreUnavailable(f"store at {plain(url)} redirects more than {_MOST_REDIRECTS} times; check its address")

    def _exchange(self, method: str, url: str, headers: Mapping[str, str], body: bytes | None) -> Reply:
        late = threading.Event()
        try:
            with (
                contextlib.closing(_connection(urlsplit(url), self.timeout_s)) as connection,
                _hang_up_after(self.timeout_s, connection, late),
            ):
                connection.request(method, _target(url), body, dict(headers))
                with contextlib.closing(connection.getresponse()) as response:
                    return self._read(url, response, late)
        except (OSError, http.client.HTTPException, ValueError) as error:
            if late.is_set() or isinstance(error, TimeoutError):
                raise StoreUnavailable(
                    f"store at {plain(url)} did not answer within {self.timeout_s:g} s; "
                    "check that the server runs, or raise timeout_s if it is only slow"
                ) from error
            raise StoreUnavailable(
                f"store at {plain(url)} cannot be reached: {error or type(error).__name__}; "
                "check that the server runs and that the address is right"
            ) from error

    def _read(self, url: str, response: http.client.HTTPResponse, late: threading.Event) -> Reply:
        content = response.read(self.max_bytes + 1)
        if late.is_set():  # a reply that ends where the connection ends looks complete when it was cut
            raise TimeoutError
        if len(content) > self.max_bytes:
            raise StoreUnavailable(
                f"store at {plain(url)} sent more than {self.max_bytes} bytes; ask for less or raise max_bytes"
            )
        if response.length:
            raise http.client.IncompleteRead(content, response.length)
        media_type = (response.getheader("Content-Type") or "").split(";")[0].strip().lower()
        return Reply(response.status, media_type, content, response.getheader("Location") or "")


@contextlib.contextmanager
def _hang_up_after(timeout_s: float, connection: http.client.HTTPConnection, late: threading.Event) -> Iterator[None]:
    """Connect, and cut the connection from another thread when time is up.

    The socket's own timeout restarts with every byte, so a server that drips would never be given up without this.
    """
    sockets: list[socket.socket] = []

    def hang_up() -> None:
        late.set()
        for sock in (connection.sock, *sockets):  # while connecting it is the first; later the reply may have taken it
            if sock is not None:
                with contextlib.suppress(OSError):  # it may have been closed in the same moment
                    sock.shutdown(socket.SHUT_RDWR)

    watchdog = threading.Timer(timeout_s, hang_up)
    watchdog.daemon = True
    watchdog.start()
    try:
        connection.connect()
        sockets.append(connection.sock)
        yield
    finally:
        watchdog.cancel()


def plain(url: str) -> str:
    """An address fit for messages: without query."""
    return urlsplit(url)._replace(query="", fragment="").geturl()


def origin(url: str) -> tuple[str, str, int]:
    """Scheme, host and port of an address."""
    parts = urlsplit(url)
    return parts.scheme, (parts.hostname or "").lower(), parts.port or (443 if parts.scheme == "https" else 80)


def _connection(parts: SplitResult, timeout_s: float) -> http.client.HTTPConnection:
    kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
    return kind(parts.hostname or "", parts.port, timeout=timeout_s)


def _target(url: str) -> str:
    parts = urlsplit(url)
    return (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
