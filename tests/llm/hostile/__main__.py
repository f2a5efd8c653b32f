"""``python -m tests.llm.hostile --port 0``: serve until killed; prints ``listening on PORT``."""

from __future__ import annotations

import argparse
import contextlib
import json
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from tests.llm.hostile.behaviours import BEHAVIOURS
from tests.llm.hostile.wire import Request, fail, send


def unknown(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """404: nobody misbehaves like that."""
    fail(handler, 404, f"no model {request['model']!r}")


class Handler(BaseHTTPRequestHandler):
    """Does what the name of the model says."""

    protocol_version = "HTTP/1.1"

    def do_GET(self) -> None:
        """The models, which are the behaviours."""
        listed = [{"id": name, "object": "model", "owned_by": "nobody"} for name in BEHAVIOURS]
        send(self, 200, json.dumps({"object": "list", "data": listed}).encode())

    def do_POST(self) -> None:
        request = json.loads(self.rfile.read(int(self.headers.get("Content-Length", 0))))
        with contextlib.suppress(OSError):  # the other side has every reason to hang up
            # A slip in a name must not look like a misbehaviour, so it is answered as real servers answer it.
            BEHAVIOURS.get(request["model"], unknown)(self, request)

    def log_message(self, format: str, *args: Any) -> None:
        pass


class Server(ThreadingHTTPServer):
    """Threads that hang die with the process."""

    daemon_threads = True

    def handle_error(self, request: object, client_address: object) -> None:
        pass


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--port", type=int, default=0)
server = Server(("127.0.0.1", parser.parse_args().port), Handler)
print(f"listening on {server.server_port}", flush=True)
server.serve_forever()
