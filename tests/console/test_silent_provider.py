"""A provider that does not answer: whoever waits for it keeps nobody waiting who has signed in."""

from __future__ import annotations

import contextlib
import socket
import time
from pathlib import Path

import pytest

pytest.importorskip("authlib", reason="the extra 'console' is not installed")

from tests.console.served import Browser, accounts, served
from tests.equipment.attended import Attended
from tests.equipment.oidc.providing import Providing, free_port

MANY = 60
"""More than a server has threads for its answers."""


@pytest.mark.slow
def test_many_who_go_to_a_provider_that_says_nothing_keep_nobody_from_an_order(tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", Ada="engineer")
    with socket.create_server(("127.0.0.1", 0), backlog=MANY) as silent, contextlib.ExitStack() as ends:
        provider = Providing(f"http://127.0.0.1:{silent.getsockname()[1]}", free_port())
        service = ends.enter_context(Attended(tmp_path / "live" / "l"))
        options = ("--people", str(people), "--sign-on", str(provider.settings(tmp_path)))
        desk = ends.enter_context(served(service.directory, *options, port=provider.console))
        ada = Browser(desk)
        assert ada.sign_in("Ada").status == 200
        head = f"GET /oidc/sign-in HTTP/1.1\r\nHost: 127.0.0.1:{desk.port}\r\n\r\n".encode()
        for _ in range(MANY):
            line = ends.enter_context(socket.create_connection(("127.0.0.1", desk.port), timeout=20.0))
            line.sendall(head)
        try:
            time.sleep(1.0)
            begun = time.monotonic()
            assert ada.send("/api/run", {}, "GET").status == 200
            assert ada.order("note", reason="look at the pump").status == 200
            assert time.monotonic() - begun < 8.0, "a provider is waited for 10 s"
        finally:
            silent.close()  # whoever waits for it learns so, and the console can end
