"""Lines of the guard outlive whoever was at their other end: it may go at any moment, also in the middle of a frame."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from multiprocessing.connection import Client, Connection, Pipe
from pathlib import Path

import numpy as np
import pytest

from homeostat.history.samples import NO_TIME, Batch
from homeostat.service.historian.line import HistoryLine
from homeostat.service.historian.messages import LARGEST, from_guard
from homeostat.service.shared import Shared

TAGS = tuple(f"T{k}" for k in range(2000))
WAITING = 100
ROUNDS = 25
LONG_S = 10.0


def batch(number: int) -> Batch:
    """Samples of second ``number``, more than a socket takes at once."""
    n = len(TAGS)
    plain = np.full(n, float(number)), np.zeros(n, dtype=np.uint32), np.full(n, NO_TIME, dtype=np.int64)
    return Batch(TAGS, np.full(n, number, dtype=np.int64), *plain, number)


@pytest.fixture
def line(tmp_path: Path) -> Iterator[HistoryLine]:
    made = HistoryLine(tmp_path / "h.sock", lambda message: True)
    yield made
    made.close(0.0)


@pytest.mark.parametrize("leaves", ["in the middle", "after nonsense"])
def test_a_historian_that_goes_while_it_is_sent_to_leaves_a_line_for_the_next_one(
    line: HistoryLine, tmp_path: Path, leaves: str
) -> None:
    for number in range(1, WAITING + 1):
        line.keep(batch(number))
    for round_ in range(ROUNDS):
        with Client(str(tmp_path / "h.sock"), family="AF_UNIX") as gone:
            assert len(taken(gone, round_ % 3)) == round_ % 3
            if leaves == "after nonsense":
                gone.send_bytes(b"nonsense")
                time.sleep(0.001)
                taken(gone, 1)
    with Client(str(tmp_path / "h.sock"), family="AF_UNIX") as following:
        assert taken(following, WAITING) == list(range(1, WAITING + 1))


def taken(connection: Connection, most: int) -> list[int]:
    """Numbers of the next so many that are sent; fewer where nothing comes any more."""
    found = list[int]()
    while len(found) < most and connection.poll(LONG_S):
        try:
            found.append(from_guard(connection.recv_bytes(LARGEST)).number)
        except (OSError, EOFError):
            break
    return found


def test_whoever_is_about_to_send_is_told_and_then_it_is_closed() -> None:
    ours, theirs = Pipe()
    shared, refused = Shared(ours), list[Exception]()

    def send() -> None:
        try:
            shared.send(bytes(LARGEST))
        except OSError as error:
            refused.append(error)

    sending = threading.Thread(target=send, daemon=True)
    sending.start()
    assert theirs.poll(LONG_S)
    shared.close()
    sending.join(LONG_S)
    assert refused
    assert ours.closed
    with pytest.raises(OSError, match="closed"):
        shared.send(b"more")
    theirs.close()


def test_the_end_is_seen_by_who_reads_and_may_come_twice() -> None:
    ours, theirs = Pipe()
    shared = Shared(ours)
    shared.end()
    shared.end()
    with pytest.raises(EOFError):
        shared.receive(10)
    shared.close()
    shared.close()
    with pytest.raises(EOFError), theirs:
        theirs.recv_bytes()


def test_a_descriptor_that_was_closed_is_nobody_elses(tmp_path: Path) -> None:
    ours, theirs = Pipe()
    shared = Shared(ours)
    shared.close()
    with (tmp_path / "journal").open("wb"), socket.socket() as other:
        shared.end()
        with pytest.raises(OSError, match="closed"):
            shared.send(b"x" * 100)
        assert other.fileno() >= 0
    assert (tmp_path / "journal").read_bytes() == b""
    theirs.close()
