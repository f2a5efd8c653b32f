"""A plant served by a process of its own: it starts, stands, goes on and dies, and its engineer's port is asked."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
from collections.abc import Mapping
from typing import Any, Final, final

ENDED_S: Final = 60.0
"""Longest that a killed server may take to be gone [s]."""
_SAID: Final = re.compile(r"(opc\.tcp://[^/]+:(\d+)/homeostat/).* engineer at 127\.0\.0\.1:(\d+)")


@final
class ServerProcess:
    """One server, which says where it is in its first line; it is started again at the same ports."""

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        self._environment = environment
        self.port = self.engineer = 0
        self.url = ""

    def start(self, command: list[str]) -> None:
        """Start ``command``, and wait until it serves."""
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, env=self._environment, start_new_session=True
        )
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        found = _SAID.search(line)
        assert found is not None, f"the server said {line!r}"
        self.url, self.port, self.engineer = found[1], int(found[2]), int(found[3])

    @property
    def pid(self) -> int:
        return self._process.pid

    def kill(self) -> None:
        """Let it die at once, also where it stands."""
        self._process.kill()
        self._process.wait(ENDED_S)
        if self._process.stdout is not None:
            self._process.stdout.close()

    def freeze(self, on: bool) -> None:
        """Stop the process, or let it go on; one that is dead already is let be."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process.pid, signal.SIGSTOP if on else signal.SIGCONT)

    def ask(self, line: str) -> Any:
        """What the engineer's port answers to ``line``."""
        with socket.create_connection(("127.0.0.1", self.engineer), 30.0) as connection:
            connection.sendall(line.encode() + b"\n")
            answer: dict[str, Any] = json.loads(connection.makefile().readline())
        assert "error" not in answer, answer
        return answer["done"]

    @property
    def commands(self) -> list[Any]:
        """Commands that have reached the plant, in order."""
        return [arrival["commands"] for arrival in self.ask("wire")]
