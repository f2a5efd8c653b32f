"""The inbox: an order is one small file, delivered whole, taken once; nothing that lies there ends a run."""

from __future__ import annotations

import fcntl
import json
import math
import os
import string
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.journal import Journal, RunStarted, Summary
from homeostat.journal.beside.files import JOURNAL
from homeostat.service.inbox import INBOX, MOST, TAKEN, Inbox, post, refuse_unattended, take_back
from homeostat.service.order import LARGEST, OrderError, run_identity

YES = PersonCommand("approve-0001", "Ada", Role.OPERATOR, Verb.APPROVE, "search-1", "ab" * 32, "it helps")

NOW_S = 1.7e9
"""Seconds since 1970."""


def now() -> float:
    """A clock that stands."""
    return NOW_S


LOCKS: list[BinaryIO] = []
"""What keeps the runs of these tests going on: a run holds the lock of its journal."""


def run_in(folder: Path, seed: int = 1) -> Path:
    """A run that has begun and goes on, with an inbox."""
    journal = Journal(folder)
    journal.record(RunStarted("vessel", (), seed), 0.0)
    journal.__exit__(None, None, None)
    LOCKS.append((folder / JOURNAL).open("rb"))
    fcntl.flock(LOCKS[-1], fcntl.LOCK_EX)
    (folder / INBOX).mkdir()
    return folder


@pytest.fixture(autouse=True)
def let_go() -> Iterator[None]:
    """Runs end with their test."""
    yield
    while LOCKS:
        LOCKS.pop().close()


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    return run_in(tmp_path / "run")


def laid(run_dir: Path, name: str, content: bytes) -> Path:
    path = run_dir / INBOX / name
    path.write_bytes(content)
    return path


def text_of(run_dir: Path, **changed: object) -> bytes:
    fields = {
        "schema": 2, "run": run_identity(run_dir), "id": "approve-0002", "issued_s": NOW_S, "person": "Ada",
        "role": "operator", "verb": "approve", "subject": "search-1",
    }  # fmt: skip
    return json.dumps({**fields, **changed}).encode()


def test_an_order_arrives_as_it_was_given_and_once(run_dir: Path) -> None:
    inbox = Inbox(run_dir, now)
    post(run_dir, YES, now)
    assert inbox.poll() == (YES,)
    assert inbox.poll() == () and Inbox(run_dir).poll() == ()
    assert [p.name for p in (run_dir / INBOX / TAKEN).iterdir()] == ["approve-0001.json"]
    assert inbox.take_troubles() == ()


@pytest.mark.parametrize(
    ("changed", "word"),
    [
        ({"extra": 1}, "extra"), ({"schema": 1}, "schema"), ({"verb": "explode"}, "verb"), ({"role": "king"}, "role"),
        ({"issued_s": "today"}, "issued_s"), ({"issued_s": -1.0}, "issued_s"), ({"issued_s": math.nan}, "issued_s"),
        ({"issued_s": math.inf}, "issued_s"), ({"issued_s": None}, "issued_s"), ({"person": ""}, "person"),
        ({"person": 7}, "person"), ({"reason": "x" * 501}, "reason"), ({"id": "approve-0003"}, "approve-0003"),
        ({"run": "0" * 64}, "another run"), ({"run": "../x"}, "run"),
    ],
)  # fmt: skip
def test_a_malformed_order_is_one_line_of_trouble(run_dir: Path, changed: dict[str, object], word: str) -> None:
    inbox = Inbox(run_dir)
    laid(run_dir, "approve-0002.json", text_of(run_dir, **changed))
    assert inbox.poll() == ()
    (trouble,) = inbox.take_troubles()
    assert "approve-0002.json" in trouble and word in trouble and "\n" not in trouble
    assert inbox.poll() == () and inbox.take_troubles() == ()


@settings(max_examples=150)
@given(content=st.binary(max_size=300) | st.text(string.printable, max_size=300).map(str.encode))
def test_whatever_lies_there_is_no_exception(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    run_dir = run_in(tmp_path_factory.mktemp("any") / "run")
    inbox = Inbox(run_dir)
    laid(run_dir, "approve-0002.json", content)
    assert inbox.poll() == () and len(inbox.take_troubles()) == 1


def test_a_file_that_is_too_large_is_not_read(run_dir: Path) -> None:
    inbox = Inbox(run_dir)
    laid(run_dir, "approve-0002.json", text_of(run_dir) + b" " * LARGEST)
    assert inbox.poll() == () and str(LARGEST) in inbox.take_troubles()[0]


def test_links_folders_partial_and_foreign_files_are_left_alone(run_dir: Path, tmp_path: Path) -> None:
    inbox = Inbox(run_dir)
    outside = tmp_path / "approve-0002.json"
    outside.write_bytes(text_of(run_dir))
    (run_dir / INBOX / "approve-0002.json").symlink_to(outside)
    (run_dir / INBOX / "approve-0004.json").mkdir()
    os.mkfifo(run_dir / INBOX / "approve-0005.json")
    laid(run_dir, ".approve-0006.json.1.partial", text_of(run_dir))
    laid(run_dir, "notes.txt", b"hello")
    assert inbox.poll() == () and inbox.take_troubles() == ()
    assert outside.exists()


def test_a_flood_is_taken_bit_by_bit(run_dir: Path) -> None:
    inbox = Inbox(run_dir)
    for number in range(MOST + 5):
        post(run_dir, replace(YES, id=f"approve-{number:04d}"))
    first, second = inbox.poll(), inbox.poll()
    assert (len(first), len(second)) == (MOST, 5)
    for number in range(200):
        laid(run_dir, f"approve-1{number:03d}.json", b"{")
    inbox.poll()
    assert 0 < len(inbox.take_troubles()) <= MOST


def test_an_inbox_that_is_taken_away_is_said_once(run_dir: Path) -> None:
    inbox = Inbox(run_dir)
    (run_dir / INBOX / TAKEN).rmdir()
    (run_dir / INBOX).rmdir()
    assert inbox.poll() == () and inbox.poll() == ()
    assert len(inbox.take_troubles()) == 1


def test_an_order_for_another_run_is_refused(run_dir: Path, tmp_path: Path) -> None:
    other = run_in(tmp_path / "other", seed=2)
    post(other, YES)
    (other / INBOX / "approve-0001.json").replace(run_dir / INBOX / "approve-0001.json")
    inbox = Inbox(run_dir)
    assert inbox.poll() == () and "another run" in inbox.take_troubles()[0]


def test_nobody_orders_anything_of_a_run_that_was_killed_or_emptied(run_dir: Path) -> None:
    refuse_unattended(run_dir)
    LOCKS.pop().close()
    with pytest.raises(OrderError, match="does not go on: it was killed"):
        refuse_unattended(run_dir)
    with pytest.raises(OrderError, match="does not go on: it was killed"):
        post(run_dir, YES)
    assert list((run_dir / INBOX).iterdir()) == []
    (run_dir / JOURNAL).write_bytes(b"")
    with pytest.raises(OrderError, match="no run that has begun"):
        refuse_unattended(run_dir)


def test_nobody_orders_anything_of_a_run_that_has_not_begun_is_over_or_takes_no_orders(tmp_path: Path) -> None:
    (tmp_path / "new" / INBOX).mkdir(parents=True)
    with pytest.raises(OrderError, match="begun"):
        post(tmp_path / "new", YES)
    run = run_in(tmp_path / "run")
    (run / INBOX).rmdir()
    with pytest.raises(OrderError, match="takes no orders"):
        post(run, YES)
    with Journal(tmp_path / "over") as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        journal.close(Summary(1, "recovered"))
    with pytest.raises(OrderError, match="is over"):
        post(tmp_path / "over", YES)


def test_an_order_that_nobody_took_is_taken_back(run_dir: Path) -> None:
    post(run_dir, YES)
    assert take_back(run_dir, YES.id) and not take_back(run_dir, YES.id)
    assert Inbox(run_dir).poll() == ()


def test_an_order_that_breaks_the_schema_is_not_posted(run_dir: Path) -> None:
    with pytest.raises(OrderError, match="person"):
        post(run_dir, replace(YES, person=""))
    with pytest.raises(OrderError, match="id"):
        post(run_dir, replace(YES, id="../../x"))
    assert list((run_dir / INBOX).iterdir()) == []


@pytest.mark.parametrize("age_s", [0.0, 7.5, 86_400.0, -30.0])
def test_an_order_is_delivered_with_its_age(run_dir: Path, age_s: float) -> None:
    post(run_dir, YES, lambda: NOW_S - age_s)
    assert Inbox(run_dir, now).poll() == (replace(YES, age_s=age_s),)


def test_an_order_that_was_taken_and_is_laid_there_again_keeps_its_name_and_grows_old(run_dir: Path) -> None:
    post(run_dir, YES, now)
    inbox = Inbox(run_dir, lambda: NOW_S + 1.0)
    (first,) = inbox.poll()
    content = (run_dir / INBOX / TAKEN / "approve-0001.json").read_bytes()
    laid(run_dir, "approve-0001.json", content)
    (again,) = Inbox(run_dir, lambda: NOW_S + 100.0).poll()
    assert first.age_s == 1.0 and again == replace(YES, age_s=100.0)
    laid(run_dir, "approve-0009.json", content)
    assert inbox.poll() == () and "names itself 'approve-0001'" in inbox.take_troubles()[0]


def test_an_order_without_a_time_of_issue_is_none(run_dir: Path) -> None:
    fields = json.loads(text_of(run_dir))
    del fields["issued_s"]
    laid(run_dir, "approve-0002.json", json.dumps(fields).encode())
    inbox = Inbox(run_dir)
    assert inbox.poll() == () and "issued_s" in inbox.take_troubles()[0]
