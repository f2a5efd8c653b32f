"""The reactor as it is served, and attached: processes of their own, as on a plant."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from homeostat.links.opcua.security.certificate import Pki
from homeostat.service.doors.asking import status
from homeostat.service.order import OrderError
from tests.cli.command import COMMAND, environment, homeostat
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
    """The reactor, served at a scale; the engineer's port moves it."""

    def __init__(self, folder: Path, scale: float) -> None:
        self.scale, self.folder = scale, folder
        self.pkis: tuple[Pki, Pki] = make_pkis(folder / "pki")
        self.port = self.engineer = 0
        self.start()
        done = homeostat(
            "link", "draft", f"opc.tcp://127.0.0.1:{self.port}/homeostat/", "--plant", "cstr", "--out", "cstr.toml",
            "--pki", str(self.pkis[1].folder), cwd=folder,
        )  # fmt: skip
        assert done.status == 0, done

    def start(self) -> None:
        """Serve, at the ports of before where it was served before."""
        arguments = [
            "serve", "cstr", "--port", str(self.port), "--engineer-port", str(self.engineer), "--scale",
            str(self.scale), "--pki", str(self.pkis[0].folder),
        ]  # fmt: skip
        self.process = subprocess.Popen(
            [*COMMAND, *arguments], stdout=subprocess.PIPE, text=True, env=environment(), start_new_session=True
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        first, _, last = line.partition("/homeostat/")
        self.port, self.engineer = int(first.rpartition(":")[2]), int(last.rpartition(":")[2])

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

    def end(self) -> None:
        self.process.kill()
        self.process.wait(LIMIT_S)
        if self.process.stdout is not None:
            self.process.stdout.close()


class Attached:
    """``homeostat attach`` in a process group of its own, so that a Ctrl-C reaches all of it as at a terminal."""

    def __init__(self, reactor: Reactor, directory: Path, *options: str) -> None:
        self.reactor, self.directory = reactor, directory
        command = [
            *COMMAND, "attach", "cstr", "--link", str(reactor.folder / "cstr.toml"), "--dir", str(directory), "--pace",
            str(reactor.scale), "--persons", "1", "--pki", str(reactor.pkis[1].folder), *options,
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
