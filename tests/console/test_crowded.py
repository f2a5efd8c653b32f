"""A console that many come to at once, or come to and say nothing: whoever is signed in is answered all the same."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import resource
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("argon2", reason="the extra 'console' is not installed")

from starlette.requests import Request
from starlette.types import Message

from homeostat.console.people.accounts import Access, Person
from homeostat.console.people.sessions import Session
from homeostat.console.server.asked import MOST_TAGS
from homeostat.console.server.desk import SENT_WITHIN_S
from homeostat.console.server.door import HEAD_S, LINES, Door, Sparing
from homeostat.console.server.lanes import OF_ONE, Gone, Lanes
from tests.console.served import Browser, Served, accounts, served

FILES, ROOM = 256, 64
"""Files that the console may open, and the connections that it has room for by that."""


@pytest.fixture(scope="module")
def crowded(recovered_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A console with people that may open few files."""
    people = accounts(tmp_path_factory.mktemp("people") / "people.json", Bo="operator")
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (FILES, hard))
    try:
        server = served(recovered_run, "--people", str(people))
        with server as found:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
            yield found
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def half(server: Served, said: bytes = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-a: ") -> socket.socket:
    """A connection on which somebody says half of something."""
    line = socket.create_connection(("127.0.0.1", server.port), timeout=20.0)
    line.sendall(said)
    return line


def is_over(line: socket.socket) -> bool:
    """Whether the other end has closed it, within its timeout."""
    try:
        return not line.recv(1 << 16)
    except TimeoutError:
        return False
    except OSError:
        return True


def test_half_sent_requests_keep_nobody_out_who_is_signed_in(crowded: Served) -> None:
    bo = Browser(crowded)
    assert bo.sign_in("Bo").status == 200
    begun, files = time.monotonic(), Path(f"/proc/{crowded.process.pid}/fd")
    asked = f"GET /api/stream?at=0&speed=1 HTTP/1.1\r\nHost: 127.0.0.1:{crowded.port}\r\nCookie: {bo.cookie}\r\n\r\n"
    with contextlib.ExitStack() as lines:
        followed = lines.enter_context(half(crowded, asked.encode()))
        assert b"200 OK" in followed.recv(1 << 16)
        silent = []
        for count in range(300):
            silent.append(lines.enter_context(half(crowded)))
            if count % 50 == 49:
                assert bo.send("/api/run", {}, "GET").status == 200
                assert len(os.listdir(files)) < FILES - ROOM
        assert followed.recv(1 << 16), "who follows goes on"
        assert is_over(silent[0]), "whoever came first and said nothing makes room"
        assert time.monotonic() - begun < 60.0
        assert followed.recv(1 << 16)
    assert bo.send("/api/me", {}, "GET").json["name"] == "Bo"


@pytest.mark.slow
def test_a_request_is_whole_in_time_or_not_answered(crowded: Served) -> None:
    begun = time.monotonic()
    head = (
        f"POST /api/session HTTP/1.1\r\nHost: 127.0.0.1:{crowded.port}\r\nOrigin: http://127.0.0.1:{crowded.port}\r\n"
        "Content-Type: application/json\r\nContent-Length: 900\r\n\r\n{"
    ).encode()
    with half(crowded) as silent, half(crowded, head) as slow, half(crowded, head) as gone:
        gone.close()  # the fixture sees that nothing is told of it but in one line
        while time.monotonic() - begun < max(HEAD_S, SENT_WITHIN_S) - 2.0:  # it goes on, drop by drop
            silent.sendall(b"x")
            slow.sendall(b" ")
            time.sleep(0.5)
        silent.settimeout(10.0)
        assert is_over(silent)
        assert b"400 Bad Request" in slow.recv(1 << 16)
    assert time.monotonic() - begun < 30.0
    assert crowded.ask("/").status == 200


def test_a_head_without_an_end_is_refused(crowded: Served) -> None:
    with half(crowded, b"GET /" + b"x" * 40_000) as line:
        assert b"400" in line.recv(1 << 16)


@pytest.mark.parametrize("path", ["/api/trend", "/api/readings.csv"])
def test_a_tag_is_asked_for_once_and_not_all_at_once(console: Served, path: str) -> None:
    assert console.ask(f"{path}?tag=T1&tag=L1").status == 200
    for tags, words in ((["T1", "T1"], "twice"), (["T1"] * (MOST_TAGS + 1), "at most"), ([], "no tag"), (["?"], "'?'")):
        answer = console.ask(f"{path}?" + "&".join(f"tag={tag}" for tag in tags))
        assert answer.status == 400 and words in answer.json["error"]


def test_a_file_of_readings_has_every_row_once(console: Served) -> None:
    rows = console.ask("/api/readings.csv?tag=T1").body.decode().splitlines()
    times = [float(row.partition(",")[0]) for row in rows[1:]]
    assert rows[0] == "time_s,T1" and len(times) > 1000 and times == sorted(set(times))


def request(name: str, gone: bool = False) -> Request:
    """A request of ``name``, who may have ``gone`` meanwhile."""

    async def receive() -> Message:
        if gone:
            return {"type": "http.disconnect"}
        return await asyncio.Future()

    session = Session(Person(name=name, access=Access.VIEWER), "", 0.0, 0.0)
    return Request({"type": "http", "headers": [], "homeostat.session": session}, receive)


def test_nothing_is_made_for_who_has_gone_and_one_person_takes_no_turn_of_another() -> None:
    made, at_once, lock = list[str](), list[int](), threading.Lock()
    now = 0

    def slow(name: str) -> None:
        nonlocal now
        with lock:
            now += 1
            at_once.append(now)
        time.sleep(0.05)
        with lock:
            now -= 1
            made.append(name)

    async def course() -> None:
        lanes = Lanes()
        many = [asyncio.create_task(lanes.make(request("Vi"), slow, "Vi")) for _ in range(20)]
        left = [asyncio.create_task(lanes.make(request("Vi", gone=True), slow, "gone")) for _ in range(20)]
        await asyncio.sleep(0.01)
        await lanes.make(request("Bo"), slow, "Bo")
        assert made.count("Vi") <= 2 * OF_ONE, "the other did not wait for all of these"
        await asyncio.gather(*many)
        assert all(isinstance(end, Gone) for end in await asyncio.gather(*left, return_exceptions=True))

    asyncio.run(course())
    assert made.count("Vi") == 20 and "gone" not in made and max(at_once) <= OF_ONE + 1


def test_a_door_closes_first_what_one_address_has_too_much_of() -> None:
    with Door(socket.AF_INET, 8) as door, contextlib.ExitStack() as lines:
        door.bind(("127.0.0.1", 0))
        door.listen(16)

        def come(address: str) -> tuple[socket.socket, socket.socket]:
            line = lines.enter_context(socket.create_connection(door.getsockname(), 5.0, (address, 0)))
            return line, lines.enter_context(door.accept()[0])

        known, other = come("127.0.0.2"), come("127.0.0.3")
        door.know(known[0].getsockname(), "Bo")
        many = [come("127.0.0.2") for _ in range(20)]
        assert door.held == 8 and [is_over(line) for line, _ in many[:14]] == [True] * 14
        for line in (known[0], other[0], many[-1][0]):
            line.settimeout(0.05)
            assert not is_over(line)
        for line, _ in many[-6:]:
            door.know(line.getsockname(), "Vi")
        come("127.0.0.2")
        assert not is_over(known[0]), "one person keeps a quarter of the room, and others what they have"
        known[1].close()
        assert door.held == 7


def test_what_others_send_fills_no_log() -> None:
    now = [0.0]
    sparing = Sparing(lambda: now[0])

    def told(count: int) -> list[str]:
        records = [logging.LogRecord("a", logging.WARNING, "", 0, "line %d", (k,), None) for k in range(count)]
        return [record.getMessage() for record in records if sparing.filter(record)]

    assert len(told(100_000)) == LINES
    now[0] += 61.0
    assert told(2) == [f"line 0 ({100_000 - LINES} more were left out)", "line 1"]
