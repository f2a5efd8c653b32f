"""A tank in four processes: a server, a network between, a guard that is attached, and thinking as a script."""

from __future__ import annotations

import contextlib
import os
import secrets
import signal
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from benchmarks.attached.asking import Asking, number_of
from benchmarks.attached.tank import Guarded
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.links.opcua.security.certificate import make_certificate
from homeostat.links.opcua.security.security import APPLICATION, SERVED
from homeostat.service.doors.asking import order, status
from homeostat.service.order import OrderError
from tests.equipment.opcua.proxy import Proxy
from tests.equipment.opcua.served import Served, make_pkis

LOOK_S = 0.05
"""How often anything is looked at, wall-clock [s]."""
LONGEST_S = 90.0
"""After this time what has not come never comes [s]."""
HEARTBEAT_S = 10.0
"""After this time without a heartbeat the served plant sheds, in process time [s]."""
EXPIRED_DAYS = -1.0 / 1440.0
"""Validity of a certificate that ended a minute ago [d]."""


class Never(Exception):
    """What had to come did not."""


@dataclass
class Rig:
    """Everything that one disturbance after another is done to."""

    folder: Path
    pace: float = 1.0
    lost: list[int] = field(default_factory=list)
    """Last request before each time that the server began anew: none before it may arrive there."""

    def __enter__(self) -> Self:
        pkis = make_pkis(self.folder / "pki")
        make_certificate(self.folder / "old" / "served", SERVED, "served", ("127.0.0.1",), EXPIRED_DAYS)
        make_certificate(self.folder / "old" / "link", APPLICATION, "link", (), EXPIRED_DAYS)
        for old, trusting in (("served", pkis[1]), ("link", pkis[0])):
            source = self.folder / "old" / old / "own" / "certificate.der"
            (trusting.trusted / f"old-{old}.der").write_bytes(source.read_bytes())
        self.stack = contextlib.ExitStack()
        self.server = self.stack.enter_context(Served(pkis, scale=self.pace, heartbeat_s=HEARTBEAT_S))
        self.proxy = self.stack.enter_context(Proxy(self.server.port))
        self.live = self.folder / "live"
        self.live.mkdir()
        guarded = Guarded(str(self.live), self.proxy.port, str(pkis[1].folder), self.pace)
        self.errors = (self.folder / "guard.txt").open("ab")
        self.guard = subprocess.Popen(guarded.command, stderr=self.errors)
        self.asking = Asking(self.live)
        self.wait(lambda: self.samples, "the first sample")
        return self

    def __exit__(self, *raised: object) -> None:
        self.asking.end()
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.guard.pid, signal.SIGCONT)
            self.guard.terminate()
        try:
            self.guard.wait(20.0)
        except subprocess.TimeoutExpired:
            self.guard.kill()
            self.guard.wait()
        self.errors.close()
        self.stack.close()

    @property
    def status(self) -> dict[str, Any]:
        """How the guard stands; nothing where it does not answer."""
        try:
            return status(self.live)
        except (OrderError, OSError, ValueError):
            return {}

    @property
    def samples(self) -> int:
        """Samples that the guard has had; 0 where it does not answer."""
        ticks = self.status.get("ticks")
        return 0 if ticks is None else ticks["number"] - ticks["without"]

    def freeze_guard(self, on: bool) -> None:
        """Let the guard's process stand, or go on."""
        os.kill(self.guard.pid, signal.SIGSTOP if on else signal.SIGCONT)

    def swap(self, side: str) -> None:
        """Change the certificate and key of ``side``, served or link, with the expired ones."""
        mine, old = self.folder / "pki" / side / "own", self.folder / "old" / side / "own"
        aside = mine.with_name("aside")
        mine.rename(aside)
        old.rename(mine)
        aside.rename(old)

    def wait(self, holds: Callable[[], Any], what: str, within_s: float = LONGEST_S) -> float:
        """How long it took until ``holds``, wall-clock [s]; Never where it did not."""
        began = time.monotonic()
        while not holds():
            if time.monotonic() - began > within_s:
                raise Never(f"{what}: not within {within_s:g} s; {self.status.get('link')}")
            time.sleep(LOOK_S)
        return time.monotonic() - began

    def back(self, within_s: float = LONGEST_S) -> float:
        """How long it takes from now until the guard has another sample, wall-clock [s]."""
        before = self.samples
        return self.wait(lambda: self.samples > max(before, 0) > 0 or (before == 0 and self.samples), "data", within_s)

    def closed_loop(self) -> float:
        """Have a person raise the mode, and a request be written; how long that took, wall-clock [s]."""
        began = time.monotonic()

        for tag in self.status.get("out_of_service", ()):  # the plant began anew at other targets: a person looks
            self.order(Verb.IN_SERVICE, tag)
        self.wait(lambda: self.order(Verb.MODE, "closed-loop") or self.mode == "closed-loop", "closed loop", 60.0)
        before = self.arrived[-1:]
        self.wait(lambda: self.arrived[-1:] != before, "a write", 60.0)
        return time.monotonic() - began

    def order(self, verb: Verb, subject: str) -> bool:
        """Whether the guard did what a person ordered."""
        command = PersonCommand(secrets.token_hex(8), "Ada", Role.ENGINEER, verb, subject, reason="looked at")
        try:
            return order(self.live, command).done
        except (OrderError, OSError):
            return False

    @property
    def mode(self) -> str:
        """The mode that the guard stands in; empty where it does not answer."""
        return str(self.status.get("mode", {}).get("actual", ""))

    @property
    def arrived(self) -> list[int]:
        """Numbers of the requests whose setpoint has reached this server's plant, in order."""
        return [number_of(v) for tag, v in _setpoints(self.server.wire) if tag == "L.sp" and v > 6.0]

    @property
    def leased(self) -> bool:
        """Whether the plant shows that somebody holds the lease."""
        return bool(self.server.ask("status")["Guard/Lease"])

    def shed_within(self, within_s: float) -> float | None:
        """After which time the plant's own control took over, wall-clock [s]; None where it did not in ``within_s``."""
        began = time.monotonic()
        while time.monotonic() - began < within_s:
            if not self.leased:
                return time.monotonic() - began
            time.sleep(LOOK_S)
        return None


def _setpoints(arrivals: Iterable[Any]) -> Iterator[tuple[str, float]]:
    for commands in arrivals:
        for tag, v, _ in commands:
            if v is not None:
                yield tag, float(v)
