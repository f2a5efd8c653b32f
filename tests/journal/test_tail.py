"""A journal that grows is read on from where it was read to, and checked as it is when it is read whole."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.events.guard import StateEntered
from homeostat.journal import BrokenChain, Journal, read_events
from homeostat.journal.beside.files import JOURNAL
from homeostat.journal.tail import Tail


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    with Journal(tmp_path / "whole") as journal:
        for number in range(20):
            journal.record(StateEntered(f"state {number}"), float(number))
    return tmp_path


@given(cuts=st.lists(st.integers(0, 3000), max_size=6))
def test_whatever_is_there_when_it_looks_it_reads_every_line_once(
    cuts: list[int], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("tail")
    with Journal(folder / "whole") as journal:
        for number in range(8):
            journal.record(StateEntered(f"state {number}"), float(number))
    content, path = (folder / "whole" / JOURNAL).read_bytes(), folder / JOURNAL
    path.write_bytes(b"")
    tail, found = Tail(folder), []
    for end in (*sorted(cuts), len(content)):
        with path.open("r+b") as file:
            file.write(content[:end])
        assert not tail.replaced()
        found += list(tail.more())
    assert found == list(read_events(folder / "whole"))


def test_a_line_that_does_not_follow_is_said_each_time(run_dir: Path) -> None:
    lines = (run_dir / "whole" / JOURNAL).read_bytes().splitlines(keepends=True)
    (run_dir / JOURNAL).write_bytes(b"".join(lines[:5]))
    tail = Tail(run_dir)
    assert len(list(tail.more())) == 5 and not list(tail.more())
    (run_dir / JOURNAL).write_bytes(b"".join([*lines[:5], *lines[6:]]))
    for _ in range(2):
        with pytest.raises(BrokenChain, match="line 6 carries number 7"):
            list(tail.more())


def test_another_journal_in_its_place_is_read_from_its_start(run_dir: Path) -> None:
    tail = Tail(run_dir / "whole")
    assert not tail.replaced() and len(list(tail.more())) >= 20
    with Journal(run_dir / "other") as journal:
        journal.record(StateEntered("elsewhere"), 0.0)
    os.replace(run_dir / "other" / JOURNAL, run_dir / "whole" / JOURNAL)
    assert tail.replaced() and next(tail.more()).fields["state"] == "elsewhere" and not tail.replaced()


def test_where_there_is_no_journal_nothing_was_replaced(tmp_path: Path) -> None:
    tail = Tail(tmp_path)
    assert not tail.replaced()
    with pytest.raises(FileNotFoundError):
        list(tail.more())
