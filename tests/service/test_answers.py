"""Answers: what a journal says of an order, and which requests wait."""

from __future__ import annotations

import fcntl
import os
import time
from pathlib import Path

from homeostat.domain.events.guard import GuardStarted, RequestAnswered
from homeostat.domain.events.people import PersonHeard
from homeostat.domain.mode import Role
from homeostat.journal import Journal, RunStarted, Summary, read_events
from homeostat.service.answers import Heard, Waiting, is_written, length, wait_for, waiting


def answered(request: str, status: str, digest: str = "d1") -> RequestAnswered:
    return RequestAnswered(request, "search", digest, status)


def heard(order: str, done: bool, reason: str = "", missing: int = 0) -> PersonHeard:
    return PersonHeard(order, "Ada", Role.OPERATOR, "approve", "r1", done, reason, missing=missing)


def test_what_was_offered_and_not_answered_waits(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        for status in ("authorised", "offered"):
            journal.record(answered("r1", status), 2.0)
        journal.record(answered("r2", "offered", "d2"), 3.0)
        journal.record(answered("r3", "offered", "d3"), 3.0)
        journal.record(answered("r3", "withdrawn", "d3"), 4.0)
        first, second = waiting(read_events(tmp_path))
    assert first == Waiting("r1", "search", "d1", 2.0)
    assert second == Waiting("r2", "search", "d2", 3.0)


def test_what_a_guard_was_asked_before_it_began_again_waits_no_more(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        journal.record(answered("r1", "offered"), 2.0)
        journal.record(GuardStarted("vessel", "c", "observe", "plant", True), 3.0)
        assert waiting(read_events(tmp_path)) == ()
        journal.record(answered("r2", "offered", "d2"), 4.0)
        assert [w.request for w in waiting(read_events(tmp_path))] == ["r2"]


def test_the_answer_to_an_order_is_found_behind_where_it_was_given(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        journal.record(heard("order-01", True), 1.0)
        before = length(tmp_path)
        assert wait_for(tmp_path, "order-01", before, 0.0) is None
        journal.record(heard("order-02", True), 2.0)
        journal.record(heard("order-01", False, "too late"), 2.0)
        journal.record(heard("order-04", False, "1 of 2 people", missing=1), 2.0)
        assert wait_for(tmp_path, "order-01", before, 0.0) == Heard(False, "too late")
        assert wait_for(tmp_path, "order-04", before, 0.0) == Heard(False, "1 of 2 people", counts=True)
        with (tmp_path / "events.jsonl").open("ab") as file:
            file.write(b'{"torn":')
        assert wait_for(tmp_path, "order-03", before, 0.0) is None


def test_nobody_waits_for_a_run_that_is_over(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        before = length(tmp_path)
        journal.record(heard("order-01", True), 1.0)
        journal.close(Summary(1, "recovered"))
    assert wait_for(tmp_path, "order-01", before, 1e6) == Heard(True, "")
    assert wait_for(tmp_path, "order-02", before, 1e6) is None


def test_a_run_that_was_killed_is_not_waited_for(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        journal.record(heard("order-02", True), 0.0)
    with (tmp_path / "events.jsonl").open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert is_written(tmp_path)
    assert not is_written(tmp_path)
    began = time.monotonic()
    assert wait_for(tmp_path, "order-01", 0, 8.0) is None and time.monotonic() - began < 4.0
    assert wait_for(tmp_path, "order-02", 0, 8.0) == Heard(True, ""), "what it had answered is told"


def test_an_answer_is_found_behind_a_line_that_was_half_written_when_the_order_was_given(tmp_path: Path) -> None:
    path = tmp_path / "events.jsonl"
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        whole = length(tmp_path)
        with path.open("ab") as file:
            file.write(b'{"seq":2,"prev":"' + b"0" * 200_000)
        before = length(tmp_path)
        assert before == whole == wait_at(tmp_path, before)
        os.truncate(path, whole)  # there was no room for it
        journal.record(heard("order-01", True), 1.0)
        assert wait_for(tmp_path, "order-01", before, 0.0) == Heard(True, "")
        assert wait_for(tmp_path, "order-01", before // 2, 0.0) == Heard(True, ""), "also from within a line"
    path.write_bytes(b"half a line")
    assert length(tmp_path) == 0


def wait_at(run_dir: Path, before: int) -> int:
    """``before``, where nothing is heard from there on."""
    assert wait_for(run_dir, "order-01", before, 0.0) is None
    return before
