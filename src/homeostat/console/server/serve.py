"""The server on this machine: a port of the loopback address, a browser, and an end with Ctrl-C."""

import logging
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

from homeostat.console.server.door import Door, Punctual, Sparing

LOOPBACK: Final = "127.0.0.1"
"""The address that is listened on unless another one is asked for: nobody on another machine reaches it."""
_WAITS_S: Final = 1
"""How long connections that are open may take to end [s]."""
_BACKLOG: Final = 128
_LONGEST_HEAD: Final = 16_384


@dataclass(frozen=True, slots=True)
class Tls:
    """Files that show which host this is."""

    certificate: Path
    """The certificate, and those that lead from it to one that browsers trust (PEM)."""
    key: Path
    """Its private key (PEM)."""


def listening(port: int, address: str = LOOPBACK) -> Door:
    """A socket that listens on ``port`` of ``address``, or on a free one for 0; OSError where it is taken."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    found = Door(family)
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((address, port))
        found.listen(_BACKLOG)
    except OSError:
        found.close()
        raise
    return found


def serve(
    app: Starlette, at: Door, browser: bool, told: Callable[[str], None], host: str = LOOPBACK,
    tls: Tls | None = None,
) -> None:  # fmt: skip
    """Answer on the socket ``at`` until Ctrl-C; ``told`` gets the address with ``host``, and so does a ``browser``.

    OSError or ValueError where the files of ``tls`` cannot be used.
    """
    named = f"[{host}]" if ":" in host else host
    address = f"{'http' if tls is None else 'https'}://{named}:{at.getsockname()[1]}/"
    settings = uvicorn.Config(
        app,
        loop="asyncio",  # others accept connections past the door
        http=Punctual,
        ws="none",
        backlog=_BACKLOG,
        h11_max_incomplete_event_size=_LONGEST_HEAD,
        log_level="warning",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=_WAITS_S,
        lifespan="off",
        ssl_certfile=None if tls is None else tls.certificate,
        ssl_keyfile=None if tls is None else str(tls.key),
    )
    app.state.door = at
    for name in ("uvicorn.error", "asyncio"):  # what others send is theirs, and may be much
        logging.getLogger(name).addFilter(Sparing())
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
