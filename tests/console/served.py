"""A console in a process of its own, as a person starts it, and what a browser may ask of it."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import subprocess
import time
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from typing import Any

import pyotp

from homeostat.console.people.accounts import Access, Account
from homeostat.console.people.changes import added
from homeostat.console.people.passwords import hashed
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


@dataclass(frozen=True, eq=False)
class Served:
    """A server that runs."""

    port: int
    process: subprocess.Popen[str]

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    def ask(self, path: str, method: str = "GET", content: bytes | None = None, **headers: str) -> Answer:
        """Put one request, exactly as it is given."""
        with contextlib.closing(HTTPConnection("127.0.0.1", self.port, timeout=120)) as connection:
            connection.request(method, path, content, headers=headers)
            response = connection.getresponse()
            return Answer(response.status, dict(response.getheaders()), response.read())

    def moments(self, path: str, count: int, **headers: str) -> list[dict[str, str]]:
        """The first ``count`` events of a stream, or all that it has."""
        found: list[dict[str, str]] = []
        with contextlib.closing(HTTPConnection("127.0.0.1", self.port, timeout=120)) as connection:
            connection.request("GET", path, headers=headers)
            response = connection.getresponse()
            assert response.status == 200 and response.headers["Content-Type"].startswith("text/event-stream")
            while len(found) < count and (event := _event(response)):
                found.append(event)
        return found


PASSWORD = "correct horse {}"
"""The password of everybody, with the name."""


def accounts(path: Path, **people: str) -> Path:
    """A file of accounts: name -> role."""
    for name, role in people.items():
        added(path, Account(name=name, access=Access(role), argon2id=hashed(PASSWORD.format(name), name)))
    return path


def code_of(secret: str, at_s: float | None = None) -> str:
    """The code that an authenticator with ``secret`` shows."""
    return str(pyotp.TOTP(secret).at(int(time.time() if at_s is None else at_s)))


@dataclass
class Browser:
    """A browser without a page: it keeps its cookie, and sends what a page would."""

    server: Served
    cookie: str = ""
    token: str = ""

    def send(self, path: str, content: Any, method: str = "POST", **changed: str) -> Answer:
        """Send ``content``; headers may be changed, and left out where they are empty."""
        headers = {
            "Content-Type": "application/json", "Origin": self.server.address.rstrip("/"), "Cookie": self.cookie,
            "X-Homeostat-Token": self.token,
        } | {name.replace("_", "-"): text for name, text in changed.items()}  # fmt: skip
        body = content if isinstance(content, bytes) else json.dumps(content).encode()
        return self.server.ask(path, method, body, **{name: text for name, text in headers.items() if text})

    def sign_in(self, name: str, password: str | None = None, **more: str) -> Answer:
        """Sign in as ``name``."""
        answer = self.send("/api/session", {"name": name, "password": password or PASSWORD.format(name)} | more)
        if answer.status == 200:
            self.cookie, self.token = answer.headers["set-cookie"].partition(";")[0], answer.json["token"]
        return answer

    def order(self, verb: str, subject: str = "", **rest: str) -> Answer:
        """Order something."""
        return self.send("/api/order", {"id": str(uuid.uuid4()), "verb": verb, "subject": subject} | rest)


def _event(response: HTTPResponse) -> dict[str, str]:
    fields: dict[str, str] = {}
    while line := response.readline().decode().rstrip("\n"):
        name, _, value = line.partition(": ")
        fields[name] = value
    return fields


SHOWN: list[Any] = []
"""Pages of which every complaint is a failure: they leave a server before it ends, as it answers none that waits."""


@contextlib.contextmanager
def served(run_dir: Path, *options: str, port: int = 0, scheme: str = "http") -> Iterator[Served]:
    """Show ``run_dir`` on a free port, or on ``port``, as long as this lasts; Ctrl-C ends it well."""
    command = [*COMMAND, "console", str(run_dir), "--no-browser", "--port", str(port), *options]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen(command, env=environment(), text=True, **pipes)  # type: ignore[call-overload]
    try:
        said = process.stdout.readline()
        found = re.match(rf"{scheme}://[^:]+:(\d+)/", said)
        assert found is not None, f"the console said {said!r}, {process.stderr.read() if not said else ''}"
        server = Served(int(found[1]), process)
        yield server
        for page in SHOWN:
            if page.url.startswith(server.address):
                page.goto("about:blank")
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=LIMIT_S)
    assert process.returncode == 0, (out, err)
    assert "Traceback" not in err, err
