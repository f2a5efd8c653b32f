"""The server on this machine: a port of the loopback address, a browser, and an end with Ctrl-C."""

import socket
import threading
import webbrowser
from collections.abc import Callable
from typing import Final

import uvicorn
from starlette.applications import Starlette

LOOPBACK: Final = "127.0.0.1"
"""The only address that is listened on: nobody on another machine reaches it."""
_WAITS_S: Final = 1
"""How long connections that are open may take to end [s]."""


def listening(port: int) -> socket.socket:
    """A socket that listens on ``port`` of this machine, or on a free one for 0; OSError where it is taken."""
    found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((LOOPBACK, port))
        found.listen(128)
    except OSError:
        found.close()
        raise
    return found


def serve(app: Starlette, at: socket.socket, browser: bool, told: Callable[[str], None]) -> None:
    """Answer on the socket ``at`` until Ctrl-C; ``told`` gets the address, and so does a ``browser``."""
    address = f"http://{LOOPBACK}:{at.getsockname()[1]}/"
    told(address)
    if browser:  # one that runs in the terminal would hold everything up
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
    settings = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=_WAITS_S,
        lifespan="off",
    )
    uvicorn.Server(settings).run(sockets=[at])
