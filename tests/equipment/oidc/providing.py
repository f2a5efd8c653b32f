"""A provider of somebody else's making in a process of its own, and a browser without a page that signs in at it."""

from __future__ import annotations

import contextlib
import re
import select
import shutil
import socket
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx2
import pytest

HERE = Path(__file__).resolve().parent
SECRET = "a secret of the client"
READY_S = 60.0
"""A provider that is not up by then is started again: node has hung before its first line, once in many starts."""
STARTS = 3


def free_port() -> int:
    """A port of this machine that nobody listens on."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@dataclass(frozen=True)
class Providing:
    """A provider that runs, for a console at one port."""

    issuer: str
    console: int

    def settings(self, folder: Path, **changed: str) -> Path:
        """A file of settings for it; ``changed`` lines of TOML by their name."""
        lines = {
            "title": '"Works login"', "issuer": f'"{self.issuer}"', "client": '"homeostat"', "secret_file": '"secret"',
            "address": f'"http://127.0.0.1:{self.console}"',
        } | changed  # fmt: skip
        path, secret = folder / "sign-on.toml", folder / "secret"
        roles = 'claim = "groups"\nengineer = ["plant-eng"]\noperator = ["plant-op"]\nviewer = ["plant-view"]\n'
        text = "".join(f"{name} = {value}\n" for name, value in lines.items() if value)
        for file, content in ((path, f"{text}[roles]\n{roles}"), (secret, f"{SECRET}\n")):
            file.touch(0o600)
            file.write_text(content)
        return path

    def rename(self, who: str, name: str) -> None:
        """Have the provider say another name of ``who``."""
        httpx2.get(f"{self.issuer}/rename", params={"id": who, "to": name}).raise_for_status()


@contextlib.contextmanager
def providing(kind: str = "", pem: Path | None = None) -> Iterator[Providing]:
    """A provider, and a free port for its console; skipped where it is not installed.

    ``pem`` has the certificate and the key of one that is asked over TLS.
    """
    if shutil.which("node") is None or not (HERE / "node_modules" / "oidc-provider").is_dir():
        pytest.skip("node oidc-provider is not installed: bash tools/provider.sh")
    port, console = free_port(), free_port()
    command = ["node", "provider.js", str(port), f"http://127.0.0.1:{console}/oidc/callback", kind, str(pem or "")]
    scheme = "http" if pem is None else "https"
    with _started(command):
        yield Providing(f"{scheme}://localhost:{port}", console)


@contextlib.contextmanager
def _started(command: list[str]) -> Iterator[None]:
    """A process that has said that it is ready."""
    for _ in range(STARTS):
        pipe, silent = subprocess.PIPE, subprocess.DEVNULL
        with subprocess.Popen(command, cwd=HERE, stdout=pipe, stderr=silent, text=True) as process:
            try:
                assert process.stdout is not None
                if select.select([process.stdout], [], [], READY_S)[0]:
                    assert process.stdout.readline() == "ready\n", "the provider ended before it was ready"
                    yield
                    return
            finally:
                process.kill()
    pytest.fail(f"the provider has not come up, {STARTS} times within {READY_S:g} s")


class Visitor(httpx2.Client):
    """A browser without a page, which signs in at the provider by filling in its form."""

    def sign_in(self, start: str, who: str) -> httpx2.Response:
        """Go to ``start``, sign in as ``who`` where the provider asks; the answer that leads to the console, or its."""
        answer = self.get(start)
        while answer.status_code in (302, 303) or "<form" in answer.text:
            if answer.status_code in (302, 303):
                where = str(answer.url.join(answer.headers["location"]))
                if "/oidc/callback" in where:
                    return answer
                answer = self.get(where)
            else:
                found = re.search(r'<form[^>]* action="([^"]+)"', answer.text)
                assert found is not None
                hidden = re.findall(r'<input type="hidden" name="([^"]+)" value="([^"]*)"', answer.text)
                filled = dict(hidden) | {"login": who, "password": "x", "logout": "yes"}
                answer = self.post(str(answer.url.join(found[1])), data=filled)
        return answer

    def back(self, start: str, who: str) -> httpx2.Response:
        """The same, and the console's answer to it."""
        answer = self.sign_in(start, who)
        return self.get(answer.headers["location"]) if "location" in answer.headers else answer
