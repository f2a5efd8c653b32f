"""A served tank in a process of its own, and a hand at its engineer's port."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self

from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.security.certificate import Pki, make_certificate
from homeostat.links.opcua.security.security import APPLICATION, SERVED, Security
from tests.equipment.opcua.tank import RULES, tank_mapping

SCALE = 5.0
"""Process seconds per second of a served tank."""
START_S = 60.0


def make_pkis(folder: Path) -> tuple[Pki, Pki]:
    """Folders of a server and of a link that trust each other."""
    server = make_certificate(folder / "served", SERVED, "served", ("127.0.0.1",))
    link = make_certificate(folder / "link", APPLICATION, "link")
    shutil.copy(server.certificate, link.trusted / "served.der")
    shutil.copy(link.certificate, server.trusted / "link.der")
    return server, link


class Served:
    """One server; it is killed at the end."""

    def __init__(self, pkis: tuple[Pki, Pki], **given: Any) -> None:
        self._given = {"port": 0, "scale": SCALE, "pki": str(pkis[0].folder), **given}
        self.pki, self.scale = pkis[1], float(self._given["scale"])
        self.start()

    def start(self) -> None:
        """Start, or start again at the same ports."""
        command = [sys.executable, "-m", "tests.equipment.opcua.tank_server", json.dumps(self._given)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        self.port, self.engineer = map(int, self._process.stdout.readline().split())
        self._given |= {"port": self.port, "engineer_port": self.engineer}

    def kill(self) -> None:
        self._process.kill()
        self._process.wait(START_S)
        assert self._process.stdout is not None
        self._process.stdout.close()

    def freeze(self, on: bool) -> None:
        """Stop the process, or let it go on."""
        os.kill(self._process.pid, signal.SIGSTOP if on else signal.SIGCONT)

    def ask(self, line: str) -> Any:
        """What the engineer's port answers to ``line``."""
        with socket.create_connection(("127.0.0.1", self.engineer), 30.0) as connection:
            connection.sendall(line.encode() + b"\n")
            answer: dict[str, Any] = json.loads(connection.makefile().readline())
        assert "error" not in answer, answer
        return answer["done"]

    @property
    def wire(self) -> list[Any]:
        """Commands that arrived, in order."""
        return [arrival["commands"] for arrival in self.ask("wire")]

    def open(self, port: int | None = None, two_step: bool = False, **connection: object) -> OpcuaLink:
        """A link to it that has just begun to connect."""
        mapping = tank_mapping(port or self.port, two_step, **connection)
        return OpcuaLink(mapping, RULES, Security(self.pki), pace=self.scale or 1.0)

    @contextlib.contextmanager
    def link(self, port: int | None = None, two_step: bool = False, **connection: object) -> Iterator[OpcuaLink]:
        """A link to it, up already."""
        with self.open(port, two_step, **connection) as link:
            wait_up(link)
            yield link

    @contextlib.contextmanager
    def stepping(self) -> Iterator[OpcuaLink]:
        """A link to it that is up, where it goes on by steps: one a look until then."""
        with self.open(publish_s=0.01, dead_s=600.0) as link:
            while link.trouble:
                self.ask("step 1")
                time.sleep(0.05)
            yield link

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        with contextlib.suppress(ProcessLookupError):
            self.freeze(False)
        self.kill()


def wait_up(link: OpcuaLink, within_s: float = 15.0) -> float:
    """How long it took until there was a sample, wall-clock [s]."""
    begin = time.monotonic()
    while time.monotonic() - begin < within_s:
        with contextlib.suppress(Exception):
            if not link.trouble and link.source.advance() is not None:
                return time.monotonic() - begin
        time.sleep(0.02)
    raise AssertionError(f"no sample within {within_s} s: {link.trouble}")
