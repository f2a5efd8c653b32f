"""Real servers for the tests: Oxigraph as a process, and a front that has the paths of a GraphDB repository."""

from __future__ import annotations

import contextlib
import http.client
import random
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import urlsplit

from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.endpoint import SparqlEndpoint
from homeostat.knowledge.store.store import GraphStore

PORTS = range(10_000, 32_000)
"""Ports that no system gives to who asks for any: beside a test, nothing comes to listen or to call from there."""


def free_port() -> int:
    """A TCP port of this host that nobody listens on now, and most likely nobody will."""
    while True:
        with socket.socket() as sock, contextlib.suppress(OSError):
            sock.bind(("127.0.0.1", random.SystemRandom().choice(PORTS)))
            return int(sock.getsockname()[1])


@contextmanager
def oxigraph_server(folder: Path | None = None) -> Iterator[str]:
    """The address of an Oxigraph server, in memory or in ``folder``; it is ready when yielded and gone afterwards."""
    binary = Path(sys.executable).with_name("oxigraph")
    if not binary.exists():
        raise FileNotFoundError(f"{binary} is missing: install the package 'oxigraph'")
    port = free_port()
    place = ["--location", str(folder)] if folder else []
    process = subprocess.Popen(
        [binary, "serve", "--bind", f"127.0.0.1:{port}", *place], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        _wait(port, process)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(60)


def _wait(port: int, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        with socket.socket() as sock:
            if sock.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.02)
    raise TimeoutError(f"oxigraph on port {port} was not ready in 60 s, exit status {process.poll()}")


@contextmanager
def http_server(handler: type[BaseHTTPRequestHandler]) -> Iterator[str]:
    """The address of a server that answers with ``handler``, each request in a thread of its own."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    server.block_on_close = False
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        server.server_close()
        thread.join(10)


class Quiet(BaseHTTPRequestHandler):
    """A handler that writes no log."""

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""

    def answer(self, status: int, media_type: str, body: bytes, **headers: str) -> None:
        """Send a complete reply."""
        self.send_response(status)
        self.send_header("Content-Type", media_type)
        self.send_header("Content-Length", str(len(body)))
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def sent(self) -> bytes:
        """The body of the request."""
        return self.rfile.read(int(self.headers.get("Content-Length") or 0))


@contextmanager
def graphdb_front(oxigraph: str, repository: str) -> Iterator[str]:
    """The address of a server with the paths of a GraphDB repository, which an Oxigraph server answers.

    Like GraphDB it states a charset, answers 404 for another repository, and tells data from updates by media type.
    """
    host = urlsplit(oxigraph)
    root = f"/repositories/{repository}"

    class Front(Quiet):
        def _forward(self) -> None:
            path, _, query = self.path.partition("?")
            body = self.sent()
            kind = (self.headers.get("Content-Type") or "").split(";")[0]
            target = {
                root: "/query",
                f"{root}/statements": "/update" if kind == "application/x-www-form-urlencoded" else "/store",
                f"{root}/rdf-graphs/service": "/store",
            }.get(path)
            if target is None:
                self.answer(404, "text/plain", f"Unknown repository or path {path}".encode())
                return
            upstream = http.client.HTTPConnection(host.hostname or "", host.port, timeout=60)
            names = ("Content-Type", "Accept")
            headers = {name: value for name in names if (value := self.headers.get(name))}
            upstream.request(self.command, f"{target}?{query}" if query else target, body or None, headers)
            reply = upstream.getresponse()
            content = reply.read()
            upstream.close()
            self.answer(reply.status, f"{reply.getheader('Content-Type') or 'text/plain'};charset=UTF-8", content)

        do_GET = do_POST = _forward

    with http_server(Front) as address:
        yield address


STORES = ("embedded", "on disk", "oxigraph server", "graphdb paths")
"""Every kind of store."""


@contextmanager
def empty_store(kind: str, oxigraph: str, folder: Path) -> Iterator[GraphStore]:
    """An empty store of a kind of :data:`STORES`, on disk in ``folder``; ``oxigraph``: address of the server."""
    with graphdb_front(oxigraph, "test") as address:
        stores: dict[str, Callable[[], GraphStore]] = {
            "embedded": EmbeddedStore,
            "on disk": lambda: EmbeddedStore(folder),
            "oxigraph server": lambda: SparqlEndpoint.oxigraph(oxigraph),
            "graphdb paths": lambda: SparqlEndpoint.graphdb(address, "test"),
        }
        store = stores[kind]()
        store.update("DROP ALL")
        yield store
