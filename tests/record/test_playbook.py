"""A playbook's file: what was written is read, whatever else stands in it is told and skipped, and it has an end."""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.events.recovery import LaterStep
from homeostat.domain.playbook import Aftermath, Ending, Margin, Setpoint
from homeostat.journal.chain import digest
from homeostat.record import playbook
from homeostat.record.playbook import PlaybookError, add_to_playbook, line_of, read_playbook
from tests.agents.entries import ANSWER, entry, stuck

HELD = Aftermath(Ending.HELD, 600.0, 1.4)
LATER = (LaterStep("t_started", "L1 >= 9", "normal", ANSWER.commands),)


@pytest.mark.parametrize(
    "one",
    [
        entry(),
        entry(stuck(0.6, 0.7), Hypothesis((), 0.3), aftermath=HELD),
        entry(answer=None, reason="nobody knows", needed=False),
        entry(answer=replace(ANSWER, then=LATER, worst=None, certificate=None)),
        entry(source="line\nbreak, « and \x1b"),
    ],
    ids=["usual", "doubtful", "unanswered", "route", "odd"],
)
def test_what_is_added_is_read(tmp_path: Path, one: Any) -> None:
    assert add_to_playbook(tmp_path / "book", [one]) == 1
    content = read_playbook(tmp_path / "book")
    assert (content.entries, content.troubles) == ((one,), ())


def test_a_file_that_is_not_there_holds_nothing_and_is_not_made(tmp_path: Path) -> None:
    assert read_playbook(tmp_path / "book").entries == () and not (tmp_path / "book").exists()
    assert add_to_playbook(tmp_path / "book", []) == 0 and not (tmp_path / "book").exists()


def test_the_same_entry_is_there_once(tmp_path: Path) -> None:
    assert add_to_playbook(tmp_path / "book", [entry(), entry()]) == 1
    assert add_to_playbook(tmp_path / "book", [entry(), entry(stuck(0.5))]) == 1
    assert len(read_playbook(tmp_path / "book").entries) == 2


def test_its_digest_is_that_of_what_was_read(tmp_path: Path) -> None:
    add_to_playbook(tmp_path / "book", [entry()])
    assert read_playbook(tmp_path / "book").sha256 == digest((tmp_path / "book").read_bytes())


# --- what is no entry --------------------------------------------------------------------------------------------


def signed(change: Callable[[dict[str, Any]], object]) -> bytes:
    """A line whose content was changed by somebody who can compute a digest."""
    content = json.loads(line_of(entry()))
    del content["sha256"]
    change(content)
    text = json.dumps(content, separators=(",", ":"))  # NaN is written as such
    return (text[:-1] + f',"sha256":"{digest(text.encode())}"}}').encode()


ODD = {
    "no JSON": b"feed to half",
    "a list": b"[]",
    "cut off": line_of(entry())[:-40],
    "one letter": line_of(entry()).replace(b"reduced_load", b"reduced_laod", 1).rstrip(),
    "deep": b"[" * 60_000,
    "long": b'{"format":1,"x":"' + b"x" * playbook.LONGEST + b'"}',
    "a number of 5000 digits": b'{"format":' + b"1" * 5000 + b"}",
    "another format": signed(lambda c: c.update(format=2)),
    "NaN": signed(lambda c: c["answer"].update(cost_share=float("nan"))),
    "NaN as a text": signed(lambda c: c["answer"].update(cost_share="NaN")),
    "infinite": signed(lambda c: c["occasion"]["hypotheses"][0]["faults"][0].update(severity="Infinity")),
    "a command of NaN": signed(lambda c: c["answer"]["commands"][0].update(value="NaN")),
    "a probability of 2": signed(lambda c: c["occasion"]["hypotheses"][0].update(probability=2.0)),
    "the same number otherwise": line_of(entry()).strip().replace(b":310.0", b":310e0"),
    "no source": signed(lambda c: c.pop("source")),
    "a number for a text": signed(lambda c: c["occasion"].update(state=3)),
    "an object for a number": signed(lambda c: c["answer"].update(cost_share={})),
    "not UTF-8": b"\xff\xfe",
}


@pytest.mark.parametrize("line", ODD.values(), ids=ODD)
def test_what_is_no_entry_is_told_with_its_line_and_skipped(tmp_path: Path, line: bytes) -> None:
    (tmp_path / "book").write_bytes(line_of(entry()) + line + b"\n" + line_of(entry(stuck(0.5))))
    content = read_playbook(tmp_path / "book")
    assert content.entries == (entry(), entry(stuck(0.5)))
    (told,) = content.troubles
    assert told.startswith("playbook 'book', line 2: ") and told.endswith("restore the file") and "\n" not in told


def test_many_such_lines_are_told_by_their_number(tmp_path: Path) -> None:
    (tmp_path / "book").write_bytes(b"x\n" * 1000)
    troubles = read_playbook(tmp_path / "book").troubles
    assert len(troubles) == playbook.TOLD + 1 and troubles[-1].startswith("playbook 'book': 995 more lines")


@given(st.binary(max_size=300))
@settings(max_examples=200)
def test_no_content_breaks_the_reading(content: bytes) -> None:
    found = playbook._content(line_of(entry()) + content, "book")
    assert found.entries[0] == entry()


@given(st.integers(0, len(line_of(entry())) - 2), st.integers(1, 255))
@settings(max_examples=200)
def test_no_byte_may_change(at: int, by: int) -> None:
    line = bytearray(line_of(entry()))
    line[at] ^= by
    assert playbook._content(bytes(line), "book").entries == ()


def test_a_line_that_was_cut_off_costs_no_other(tmp_path: Path) -> None:
    (tmp_path / "book").write_bytes(line_of(entry()) + line_of(entry(stuck(0.5)))[:100])
    assert add_to_playbook(tmp_path / "book", [entry(stuck(0.4))]) == 1
    content = read_playbook(tmp_path / "book")
    assert content.entries == (entry(), entry(stuck(0.4))) and len(content.troubles) == 1


@pytest.mark.parametrize(
    "make",
    [
        lambda: Setpoint("T1.sp", float("nan")),
        lambda: Margin("ACC", float("inf"), "K"),
        lambda: replace(ANSWER, cost_share=float("nan")),
        lambda: Aftermath(Ending.HELD, float("inf"), None),
        lambda: Aftermath(Ending.HELD, 1.0, float("nan")),
        lambda: entry(stuck(float("nan"))),
        lambda: entry(stuck(0.5, -0.1)),
    ],
)
def test_no_entry_has_a_number_that_is_none(make: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=r"must"):
        make()


# --- files that are none, full or shared -------------------------------------------------------------------------


def test_what_is_no_file_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name in ("pipe", "folder"):
        with pytest.raises(PlaybookError, match=f"{name}' is no file; name one"):
            read_playbook(tmp_path / name)
    with pytest.raises((PlaybookError, OSError)):
        add_to_playbook(tmp_path / "folder", [entry()])
    with pytest.raises((PlaybookError, OSError)):
        add_to_playbook(tmp_path / "pipe", [entry()])


def test_a_file_that_grew_too_large_is_read_up_to_its_bound(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = line_of(entry())
    monkeypatch.setattr(playbook, "MOST_BYTES", 3 * len(one) + 10)
    (tmp_path / "book").write_bytes(one * 20)
    content = read_playbook(tmp_path / "book")
    assert len(content.entries) == 3 and "longer than" in content.troubles[0]


def test_a_full_file_is_not_added_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    add_to_playbook(tmp_path / "book", [entry()])
    before = (tmp_path / "book").read_bytes()
    monkeypatch.setattr(playbook, "MOST_BYTES", len(before) + 100)
    with pytest.raises(PlaybookError, match="nothing was added: begin another file"):
        add_to_playbook(tmp_path / "book", [entry(stuck(0.5))])
    assert (tmp_path / "book").read_bytes() == before


def test_a_file_that_another_process_keeps_is_not_waited_for_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(playbook, "WAIT_S", 0.05)
    add_to_playbook(tmp_path / "book", [entry()])
    with (tmp_path / "book").open() as file:
        playbook.fcntl.flock(file, playbook.fcntl.LOCK_EX)
        with pytest.raises(PlaybookError, match=r"in use for 0\.05 s"):
            add_to_playbook(tmp_path / "book", [entry(stuck(0.5))])
        assert read_playbook(tmp_path / "book").entries == (entry(),), "reading waits for nobody"


def test_a_disk_that_takes_no_more_leaves_the_file_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    add_to_playbook(tmp_path / "book", [entry()])
    before, write = (tmp_path / "book").read_bytes(), os.write
    left = iter([100])

    def some(descriptor: int, content: bytes) -> int:
        for number in left:
            return write(descriptor, content[:number])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "write", some)
    with pytest.raises(OSError, match="book"):
        add_to_playbook(tmp_path / "book", [entry(stuck(0.5))])
    monkeypatch.undo()
    assert (tmp_path / "book").read_bytes() == before


def _adds(path: Path, first: int) -> None:
    for k in range(25):
        add_to_playbook(path, [entry(source=f"{first + k}")])


def test_two_processes_may_add_at_once(tmp_path: Path) -> None:
    context = multiprocessing.get_context("fork")
    both = [context.Process(target=_adds, args=(tmp_path / "book", first)) for first in (0, 100)]
    for one in both:
        one.start()
    for one in both:
        one.join(60.0)
    content = read_playbook(tmp_path / "book")
    assert [one.exitcode for one in both] == [0, 0] and content.troubles == ()
    assert {int(e.source) for e in content.entries} == {*range(25), *range(100, 125)} and len(content.entries) == 50
