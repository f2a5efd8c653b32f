"""A console in a process of its own, as a person starts it, and what a browser may ask of it."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from typing import Any

from tests.cli.command import COMMAND, LIMIT_S, environment


@dataclass(frozen=True)
class Answer:
    """What came back."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


@dataclass(frozen=True)
class Served:
    """A server that runs."""

    port: int
    process: subprocess.Popen[str]

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    def ask(self, path: str, method: str = "GET", **headers: str) -> Answer:
        """Put one request, exactly as it is given."""
        with contextlib.closing(HTTPConnection("127.0.0.1", self.port, timeout=30)) as connection:
            connection.request(method, path, headers=headers)
            response = connection.getresponse()
            return Answer(response.status, dict(response.getheaders()), response.read())

    def moments(self, path: str, count: int, **headers: str) -> list[dict[str, str]]:
        """The first ``count`` events of a stream, or all that it has."""
        found: list[dict[str, str]] = []
        with contextlib.closing(HTTPConnection("127.0.0.1", self.port, timeout=30)) as connection:
            connection.request("GET", path, headers=headers)
            response = connection.getresponse()
            assert response.status == 200 and response.headers["Content-Type"].startswith("text/event-stream")
            while len(found) < count and (event := _event(response)):
                found.append(event)
        return found


def _event(response: HTTPResponse) -> dict[str, str]:
    fields: dict[str, str] = {}
    while line := response.readline().decode().rstrip("\n"):
        name, _, value = line.partition(": ")
        fields[name] = value
    return fields


@contextlib.contextmanager
def served(run_dir: Path) -> Iterator[Served]:
    """Show ``run_dir`` on a free port as long as this lasts; Ctrl-C ends it well."""
    command = [*COMMAND, "console", str(run_dir), "--no-browser", "--port", "0"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen(command, env=environment(), text=True, **pipes)  # type: ignore[call-overload]
    try:
        said = process.stdout.readline()
        found = re.match(r"http://127\.0\.0\.1:(\d+)/", said)
        assert found is not None, f"the console said {said!r}, {process.stderr.read() if not said else ''}"
        yield Served(int(found[1]), process)
    finally:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0, (out, err)
    assert "Traceback" not in err, err
