"""A TCP proxy that can be told to swallow everything, as a firewall that lost its state does, or to cut."""

from __future__ import annotations

import contextlib
import selectors
import socket
import threading
from typing import Self


class Proxy:
    """Forwards connections to a port of this machine, in a thread of its own."""

    def __init__(self, port: int) -> None:
        self._to, self._swallow, self._ended = port, False, False
        self._cutting, self._cut = threading.Event(), threading.Event()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ, None)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def swallow(self, on: bool) -> None:
        """Take what comes from either side and pass nothing on; connections stay open, new ones are taken."""
        self._swallow = on

    def cut(self) -> None:
        """Close every connection that there is."""
        self._cut.clear()
        self._cutting.set()
        assert self._cut.wait(30.0), "the proxy's thread has ended"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self._ended = True
        self._thread.join(30.0)
        self._close_all()
        self._listener.close()
        self._selector.close()

    def _run(self) -> None:
        while not self._ended:
            if self._cutting.is_set():
                self._cutting.clear()
                self._close_all()
                self._cut.set()
            for key, _ in self._selector.select(0.1):
                if key.data is None:
                    self._take()
                else:
                    self._pass(key.fileobj, key.data)  # type: ignore[arg-type]

    def _take(self) -> None:
        near, _ = self._listener.accept()
        try:
            far = socket.create_connection(("127.0.0.1", self._to), 1.0)
        except OSError:
            near.close()
            return
        for one, other in ((near, far), (far, near)):
            self._selector.register(one, selectors.EVENT_READ, other)

    def _pass(self, one: socket.socket, other: socket.socket) -> None:
        try:
            data = one.recv(65536)
            if data and not self._swallow:
                other.sendall(data)
        except OSError:
            data = b""
        if not data:
            self._close(one, other)

    def _close_all(self) -> None:
        for key in list(self._selector.get_map().values()):
            if key.data is not None:
                self._close(key.fileobj, key.data)  # type: ignore[arg-type]

    def _close(self, *ends: socket.socket) -> None:
        for end in ends:
            with contextlib.suppress(KeyError, ValueError):
                self._selector.unregister(end)
            end.close()
