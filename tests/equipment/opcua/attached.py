"""The reactor as it is served, and attached: processes of their own, as on a plant."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from homeostat.links.opcua.security.certificate import Pki
from homeostat.service.doors.asking import status
from homeostat.service.order import OrderError
from tests.cli.command import COMMAND, environment, homeostat
from tests.equipment.opcua.process import ServerProcess
from tests.equipment.opcua.served import make_pkis

LIMIT_S = 150.0
"""Longest wait for anything, wall-clock [s]."""


def until(holds: Callable[[], Any], what: str, within_s: float = LIMIT_S) -> Any:
    """What ``holds`` gives, as soon as it is true."""
    end = time.monotonic() + within_s
    while not (found := holds()):
        assert time.monotonic() < end, f"{what}: not within {within_s:g} s"
        time.sleep(0.05)
    return found


class Reactor:
    """The reactor, or another ``case``, served at a scale, and the mapping to it; the engineer's port moves it."""

    def __init__(self, folder: Path, scale: float, *options: str, case: str = "cstr") -> None:
        self.scale, self.folder, self._options, self.case = scale, folder, options, case
        self.pkis: tuple[Pki, Pki] = make_pkis(folder / "pki")
        self._server = ServerProcess(environment())
        self.kill, self.freeze, self.ask = self._server.kill, self._server.freeze, self._server.ask
        self.start()
        self.mapping = folder / "cstr.toml"
        done = homeostat(
            "link", "draft", self.url, "--plant", case, "--out", str(self.mapping), "--pki", str(self.pkis[1].folder),
            cwd=folder,
        )  # fmt: skip
        assert done.status == 0, done

    def start(self) -> None:
        """Serve, at the ports of before where it was served before."""
        ports = "--port", str(self._server.port), "--engineer-port", str(self._server.engineer)
        given = "--scale", str(self.scale), "--pki", str(self.pkis[0].folder), *self._options
        self._server.start([*COMMAND, "serve", self.case, *ports, *given])

    @property
    def url(self) -> str:
        """Where it is served."""
        return self._server.url

    @property
    def commands(self) -> list[Any]:
        """Commands that have reached the plant, in order."""
        return self._server.commands

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.kill()


class Attached:
    """``homeostat attach`` in a process group of its own, so that a Ctrl-C reaches all of it as at a terminal."""

    def __init__(self, reactor: Reactor, directory: Path, *options: str, unsigned: bool = True) -> None:
        self.reactor, self.directory = reactor, directory
        vouched = ("--unsigned",) if unsigned else ()
        command = [
            *COMMAND, "attach", reactor.case, "--link", str(reactor.mapping), "--dir", str(directory), "--pace",
            str(reactor.scale), "--persons", "1", "--pki", str(reactor.pkis[1].folder), *vouched, *options,
        ]  # fmt: skip
        self.errors = directory.parent / f"{directory.name}.txt"
        with self.errors.open("a") as errors:
            self.process = subprocess.Popen(command, stderr=errors, env=environment(), start_new_session=True)

    @property
    def status(self) -> dict[str, Any]:
        """How it stands; nothing where nobody answers."""
        try:
            return status(self.directory)
        except OrderError:
            return {}

    def waits_for(self, holds: Callable[[dict[str, Any]], Any], what: str, within_s: float = LIMIT_S) -> dict[str, Any]:
        """How it stands, as soon as that ``holds``."""

        def held() -> dict[str, Any]:
            assert self.process.poll() is None, self.errors.read_text()
            now = self.status
            return now if now and holds(now) else {}

        try:
            found: dict[str, Any] = until(held, what, within_s)
        except AssertionError as late:
            raise AssertionError(f"{late}; {self.status}; {self.errors.read_text()}") from None
        return found

    def order(self, verb: str, *about: str) -> tuple[int, str]:
        """Exit status and output of an order."""
        done = homeostat(verb, str(self.directory), *about, cwd=self.directory.parent)
        return done.status, done.out or done.err

    def interrupt(self) -> int:
        """Ctrl-C at its terminal; the exit status."""
        os.killpg(self.process.pid, signal.SIGINT)
        return self.process.wait(LIMIT_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        with contextlib.suppress(ProcessLookupError):
            self.process.terminate()
        try:
            self.process.wait(20.0)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait(LIMIT_S)
