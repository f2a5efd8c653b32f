"""``python -m tests.llm.hostile --port 0``: serve until killed; prints ``listening on PORT``."""

from __future__ import annotations

import argparse
import contextlib
import json
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from tests.llm.hostile.behaviours import BEHAVIOURS


class Handler(BaseHTTPRequestHandler):
    """Does what the name of the model says."""

    protocol_version = "HTTP/1.1"

    def do_POST(self) -> None:
        request = json.loads(self.rfile.read(int(self.headers.get("Content-Length", 0))))
        with contextlib.suppress(OSError):  # the other side has every reason to hang up
            BEHAVIOURS[request["model"]](self, request)

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
