"""The server on this machine: a port of the loopback address, a browser, and an end with Ctrl-C."""

import socket
import threading
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Final

import uvicorn
from starlette.applications import Starlette

LOOPBACK: Final = "127.0.0.1"
"""The address that is listened on unless another one is asked for: nobody on another machine reaches it."""
_WAITS_S: Final = 1
"""How long connections that are open may take to end [s]."""


@dataclass(frozen=True, slots=True)
class Tls:
    """Files that show which host this is."""

    certificate: Path
    """The certificate, and those that lead from it to one that browsers trust (PEM)."""
    key: Path
    """Its private key (PEM)."""


def listening(port: int, address: str = LOOPBACK) -> socket.socket:
    """A socket that listens on ``port`` of ``address``, or on a free one for 0; OSError where it is taken."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    found = socket.socket(family, socket.SOCK_STREAM)
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((address, port))
        found.listen(128)
    except OSError:
        found.close()
        raise
    return found


def serve(
    app: Starlette, at: socket.socket, browser: bool, told: Callable[[str], None], host: str = LOOPBACK,
    tls: Tls | None = None,
) -> None:  # fmt: skip
    """Answer on the socket ``at`` until Ctrl-C; ``told`` gets the address with ``host``, and so does a ``browser``.

    OSError or ValueError where the files of ``tls`` cannot be used.
    """
    named = f"[{host}]" if ":" in host else host
    address = f"{'http' if tls is None else 'https'}://{named}:{at.getsockname()[1]}/"
    settings = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=_WAITS_S,
        lifespan="off",
        ssl_certfile=None if tls is None else tls.certificate,
        ssl_keyfile=None if tls is None else str(tls.key),
    )
    settings.load()  # files that cannot be used are told of before the address is
    told(address)
    if browser:  # one that runs in the terminal would hold everything up
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
    _Server(settings, app.state.ending).run(sockets=[at])


class _Server(uvicorn.Server):
    """Ends the streams that pages follow before it waits for what is open."""

    def __init__(self, config: uvicorn.Config, ending: threading.Event) -> None:
        super().__init__(config)
        self._ending = ending

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """A signal to end has come."""
        self._ending.set()
        super().handle_exit(sig, frame)
