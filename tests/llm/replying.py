"""A server in a thread of the test: it answers as the test says, and keeps what it was sent."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, TypeAlias

Respond: TypeAlias = Callable[[dict[str, Any]], tuple[int, bytes]]


@dataclass
class Server:
    """What it answers, and what it was sent."""

    status: int = 200
    body: bytes = b"{}"
    headers: Mapping[str, str] = field(default_factory=dict)
    received: list[dict[str, str]] = field(default_factory=list)
    """Headers of every request, names in lower case."""
    bodies: list[bytes] = field(default_factory=list)
    url: str = ""
    respond: Respond | None = None
    """What it makes of a request instead: status and body."""


@contextmanager
def replying(
    status: int = 200, body: bytes = b"{}", headers: Mapping[str, str] | None = None, respond: Respond | None = None
) -> Iterator[Server]:
    """A running server; its address is in ``url``."""
    said = Server(status, body, headers or {}, respond=respond)

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            said.received.append({name.lower(): value for name, value in self.headers.items()})
            said.bodies.append(self.rfile.read(int(self.headers.get("Content-Length", 0))))
            status, body = said.status, said.body
            if said.respond is not None:
                status, body = said.respond(json.loads(said.bodies[-1]))
            self.send_response(status)
            for name, value in said.headers.items():
                self.send_header(name, value)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        do_POST = do_GET

        def log_message(self, format: str, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    said.url = f"http://127.0.0.1:{server.server_port}"
    try:
        yield said
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
