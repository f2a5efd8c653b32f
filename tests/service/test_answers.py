"""Answers: what a journal says of an order, and which requests wait."""

from __future__ import annotations

from pathlib import Path

from homeostat.domain.guard_events import PersonHeard, RequestAnswered
from homeostat.domain.mode import Role
from homeostat.domain.recovery import Command
from homeostat.service.answers import Heard, length, wait_for, waiting
from homeostat.trace import Journal, RunStarted, Summary, read_events
from homeostat.trace.decisions import Attempted


def answered(request: str, status: str, digest: str = "d1") -> RequestAnswered:
    return RequestAnswered(request, "search", digest, status)


def heard(order: str, done: bool, reason: str = "") -> PersonHeard:
    return PersonHeard(order, "Ada", Role.OPERATOR, "approve", "r1", done, reason)


def test_what_was_offered_and_not_answered_waits_with_its_commands(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        journal.record(Attempted(1, "search", ("a", "b"), (Command("T.sp", 300.0, 0.5),), "d1", True, (), 4), 1.0)
        for status in ("authorised", "offered"):
            journal.record(answered("r1", status), 2.0)
        journal.record(answered("r2", "offered", "d2"), 3.0)
        journal.record(answered("r3", "offered", "d3"), 3.0)
        journal.record(answered("r3", "withdrawn", "d3"), 4.0)
        first, second = waiting(read_events(tmp_path))
    assert (first.request, first.digest) == ("r1", "d1")
    assert [(c["tag"], c["value"]) for c in first.commands] == [("T.sp", 300.0)]
    assert (second.request, second.commands, second.findings) == ("r2", (), ())


def test_the_answer_to_an_order_is_found_behind_where_it_was_given(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("vessel", (), 1), 0.0)
        journal.record(heard("order-01", True), 1.0)
        before = length(tmp_path)
        assert wait_for(tmp_path, "order-01", before, 0.0) is None
        journal.record(heard("order-02", True), 2.0)
        journal.record(heard("order-01", False, "too late"), 2.0)
        assert wait_for(tmp_path, "order-01", before, 0.0) == Heard(False, "too late")
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
