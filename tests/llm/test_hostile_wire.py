"""The server that misbehaves below the answer: connections and bodies, and the servers' own start and end."""

from __future__ import annotations

import http.client
import json
import socket
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from urllib.parse import urlsplit

import pytest

from tests.llm.hostile import transport
from tests.llm.hostile.asking import answer, asked, whole
from tests.llm.hostile.behaviours import BEHAVIOURS
from tests.llm.servers import hostile, served


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with hostile() as address:
        yield address


def never_answers(url: str) -> None:
    with asked(url, "hang", 0.3) as connection, pytest.raises(TimeoutError):
        connection.getresponse()


def drips(url: str) -> None:
    begin = time.monotonic()
    with asked(url, "slow_drip") as connection, connection.getresponse() as reply:
        assert reply.status == 200
        assert [reply.read(1) for _ in range(4)] == [b" "] * 4
    assert time.monotonic() - begin > 0.5, "no faster than it drips"


def does_not_end(url: str) -> None:
    with asked(url, "endless") as connection, connection.getresponse() as reply:
        assert sum(len(reply.read(100_000)) for _ in range(50)) == 5_000_000


def is_huge(url: str) -> None:
    with asked(url, "huge") as connection, connection.getresponse() as reply:
        assert reply.status == 200 and int(reply.headers["Content-Length"]) > 200_000_000
        assert reply.read(1000).endswith(b"x" * 100) and reply.read(100_000) == b"x" * 100_000


def is_nested(url: str) -> None:
    with pytest.raises(RecursionError):
        json.loads(whole(url, "deep")[2])
    with pytest.raises(RecursionError):
        json.loads(answer(url, "deep_answer"))


def unpacks_to_a_gigabyte(url: str) -> None:
    _, headers, body = whole(url, "gzip_bomb")
    unpacking = zlib.decompressobj(wbits=31)
    first = unpacking.decompress(body)
    one = len(body) - len(unpacking.unused_data)
    assert headers["Content-Encoding"] == "gzip" and len(body) < 2_000_000
    assert not any(first[::1000]) and body == body[:one] * 100 and len(first) * 100 == 1_000_000_000


def breaks_off(url: str) -> None:
    with pytest.raises(http.client.IncompleteRead) as broken:
        whole(url, "dropped")
    assert broken.value.partial.startswith(b'{"id"')


def is_reset(url: str) -> None:
    with asked(url, "reset") as connection, pytest.raises(ConnectionResetError) as error:
        connection.getresponse()
    assert error.type is ConnectionResetError, "a connection that was merely closed is a kind of this in the library"


def has_too_many_headers(url: str) -> None:
    with (
        asked(url, "header_bomb") as connection,
        pytest.raises(http.client.HTTPException, match="more than 100 headers"),
    ):
        connection.getresponse()


WIRE: dict[str, Callable[[str], None]] = {
    "hang": never_answers, "slow_drip": drips, "endless": does_not_end, "huge": is_huge, "deep": is_nested,
    "deep_answer": is_nested, "gzip_bomb": unpacks_to_a_gigabyte, "dropped": breaks_off, "reset": is_reset,
    "header_bomb": has_too_many_headers,
}  # fmt: skip


@pytest.mark.parametrize("behaviour", WIRE)
def test_the_connection_says_it(url: str, behaviour: str) -> None:
    WIRE[behaviour](url)


def test_all_of_them_are_tested() -> None:
    below = {name for name, function in BEHAVIOURS.items() if function.__module__ == transport.__name__}
    assert WIRE.keys() == below | {"header_bomb"}


def test_it_dies_though_somebody_still_waits() -> None:
    with ExitStack() as waiting:
        with hostile() as url:
            for behaviour in ("hang", "endless", "slow_drip"):
                waiting.enter_context(asked(url, behaviour))
            time.sleep(0.1)  # all three are at it by then
        with socket.socket() as sock:
            assert sock.connect_ex((urlsplit(url).hostname, urlsplit(url).port)) != 0


def test_a_server_that_does_not_start_says_why() -> None:
    with pytest.raises(RuntimeError, match="invalid int value"), served("tests.llm.random_model", "--seed", "many"):
        pass
    with pytest.raises(RuntimeError, match="did not start within"), served("http.server", within_s=0.05):
        pass
