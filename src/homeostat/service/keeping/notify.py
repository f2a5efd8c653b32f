"""What a service tells systemd (sd_notify): that it is ready, goes on, and stops. Without systemd nobody is told."""

import contextlib
import os
import socket
from typing import Final, final

_VARIABLE: Final = "NOTIFY_SOCKET"


@final
class Notify:
    """Tells the service manager that has started this process, if one has."""

    def __init__(self) -> None:
        """Where the environment says; other processes that are begun from here tell nothing."""
        self._address = os.environ.pop(_VARIABLE, "")

    def tell(self, text: str) -> None:
        """Say ``text``, as ``READY=1``; what cannot be told is let be."""
        if not self._address:
            return
        address = "\0" + self._address[1:] if self._address.startswith("@") else self._address
        with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as told:
            told.setblocking(False)
            told.sendto(text.encode(), address)
