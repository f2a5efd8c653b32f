"""A served tank in a process of its own, and a hand at its engineer's port."""

from __future__ import annotations

import contextlib
import json
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self

from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.security.certificate import Pki, make_certificate
from homeostat.links.opcua.security.security import APPLICATION, SERVED, Security
from tests.equipment.opcua.process import ServerProcess
from tests.equipment.opcua.tank import RULES, tank_mapping

SCALE = 5.0
"""Process seconds per second of a served tank."""


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
        self._reached_s = 0.0
        self._server = ServerProcess()
        self.kill, self.freeze, self.ask = self._server.kill, self._server.freeze, self._server.ask
        self.start()

    def start(self) -> None:
        """Start, or start again at the same ports."""
        given = self._given | {"port": self.port or self._given["port"], "engineer_port": self.engineer}
        self._server.start([sys.executable, "-m", "tests.equipment.opcua.tank_server", json.dumps(given)])

    @property
    def port(self) -> int:
        return self._server.port

    @property
    def back_s(self) -> float:
        """Data must be there again so soon after the server is, wall-clock [s]: 10 s where connecting takes no time.

        Attempts come 3 s apart at most, and on a busy host each takes as long as the first one took.
        """
        return 10.0 + 3.0 * self._reached_s

    @property
    def engineer(self) -> int:
        return self._server.engineer

    @property
    def wire(self) -> list[Any]:
        """Commands that arrived, in order."""
        return self._server.commands

    def open(self, port: int | None = None, two_step: bool = False, **connection: object) -> OpcuaLink:
        """A link to it that has just begun to connect."""
        mapping = tank_mapping(port or self.port, two_step, **connection)
        return OpcuaLink(mapping, RULES, Security(self.pki), pace=self.scale or 1.0)

    @contextlib.contextmanager
    def link(self, port: int | None = None, two_step: bool = False, **connection: object) -> Iterator[OpcuaLink]:
        """A link to it, up already."""
        with self.open(port, two_step, **connection) as link:
            self._reached_s = wait_up(link)
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
        self.kill()


def wait_up(link: OpcuaLink, within_s: float = 60.0) -> float:
    """How long it took until there was a sample, wall-clock [s]."""
    begin = time.monotonic()
    while time.monotonic() - begin < within_s:
        with contextlib.suppress(Exception):
            if not link.trouble and link.source.advance() is not None:
                return time.monotonic() - begin
        time.sleep(0.02)
    raise AssertionError(f"no sample within {within_s} s: {link.trouble}")
