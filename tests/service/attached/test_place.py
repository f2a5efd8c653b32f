"""The directory of an attached plant: held by one service, and gone on with by the same plant alone."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from homeostat.domain.events.people import ModeEntered
from homeostat.guard.restart.memory import FOLDED, Memory
from homeostat.journal import BrokenChain, Journal, Record, Resumed, RunStarted, Setting, Summary, read_events
from homeostat.journal.found import Found
from homeostat.record.decode import decode
from homeostat.record.directory import RunDirectory, RunDirectoryError
from homeostat.service.attached.place import RECALLED, AttachError, begins, changed, first_event, hold, refuse_unfit
from tests.cli.command import homeostat, homeostat_process, refused
from tests.cli.conftest import RECOVERY, once

CHOSEN = (Setting("configuration", "c" * 64), Setting("pace", 1.0))


def attached(directory: Path, closed: bool = True) -> None:
    with Journal(directory) as journal:
        journal.record(first_event("tank", CHOSEN, "", ()), 0.0)
        if closed:
            journal.close(Summary(1, "stopped", "c" * 64))


def past(directory: Path) -> tuple[Record, ...]:
    return tuple(read_events(directory, RECALLED))


def reopened(directory: Path, stated: tuple[Setting, ...] = CHOSEN) -> tuple[Record, ...]:
    """What a service that begins in ``directory`` reads of its journal."""
    again, records = RunDirectory.reopen(directory, RECALLED, lambda records: changed(records, stated))
    with again:
        return records


def test_one_directory_has_one_service(tmp_path: Path) -> None:
    lock = hold(tmp_path / "live")
    with pytest.raises(AttachError, match="is attached already; stop that service, or choose another --dir"):
        hold(tmp_path / "live", 0.3)
    os.close(lock)
    os.close(hold(tmp_path / "live"))


def test_a_directory_that_a_dying_guard_has_is_waited_for(tmp_path: Path) -> None:
    lock = hold(tmp_path / "live")
    guard = os.fork()
    if guard == 0:  # it has the lock of whoever began it, and sees a moment later that there is nobody any more
        time.sleep(1.0)
        os._exit(0)
    os.close(lock)
    begin = time.monotonic()
    os.close(hold(tmp_path / "live"))
    assert 0.5 < time.monotonic() - begin < 5.0
    os.waitpid(guard, 0)


def test_a_path_that_is_too_long_for_a_socket_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    with pytest.raises(AttachError, match="107 are possible; choose a shorter one"):
        hold(tmp_path / ("x" * 120))
    assert not list(tmp_path.iterdir())


def test_the_same_plant_may_go_on(tmp_path: Path) -> None:
    attached(tmp_path)
    refuse_unfit(tmp_path, "tank", "c" * 64)
    assert [record.kind for record in reopened(tmp_path)] == [RunStarted.kind]
    assert not (tmp_path / "manifest.json").exists()


def test_what_has_changed_since_is_in_the_line_with_which_it_goes_on(tmp_path: Path) -> None:
    attached(tmp_path)
    signed, faster = Setting("signed", "signed by 'Ada'"), Setting("pace", 2.0)
    assert changed(past(tmp_path), CHOSEN) == ()
    for stated, expected in (
        ((*CHOSEN, signed), (signed,)),
        ((CHOSEN[0], faster, signed), (faster,)),
        (CHOSEN, (CHOSEN[1],)),
    ):
        before = past(tmp_path)
        assert changed(before, stated) == expected
        assert reopened(tmp_path, stated) == before
    last = decode([record for record in past(tmp_path) if record.kind == Resumed.kind][-1])
    assert isinstance(last, Resumed) and last.changed == (CHOSEN[1],) and not last.torn


@pytest.mark.parametrize("closed", [True, False])
def test_a_journal_that_is_not_what_was_written_is_not_opened_again(tmp_path: Path, closed: bool) -> None:
    attached(tmp_path, closed)
    journal = tmp_path / "events.jsonl"
    whole = journal.read_bytes()
    journal.write_bytes(whole.replace(b'"seq":1', b'"seq":2', 1))
    for _ in range(2):  # and nobody else is kept from it
        with pytest.raises(BrokenChain, match="line 1 carries number 2"):
            reopened(tmp_path)
    assert (tmp_path / "manifest.json").exists() == closed
    journal.write_bytes(whole)
    assert reopened(tmp_path) == past(tmp_path)[:1]


def test_a_journal_that_a_guard_still_writes_is_neither_read_nor_opened(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "live") as directory:
        directory.record(first_event("tank", CHOSEN, "", ()), 0.0)
        with pytest.raises(RunDirectoryError, match="still goes on"):
            reopened(tmp_path / "live")
    assert len(reopened(tmp_path / "live")) == len(past(tmp_path / "live")) - 1


@pytest.mark.parametrize(("plant", "configuration"), [("tank", "d" * 64), ("cstr", "c" * 64)])
def test_another_plant_or_configuration_may_not(tmp_path: Path, plant: str, configuration: str) -> None:
    attached(tmp_path)
    with pytest.raises(AttachError, match=r"choose another directory with --dir, after a look at the latch"):
        refuse_unfit(tmp_path, plant, configuration)


def test_a_run_is_no_attached_plant(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("tank", (), 1), 0.0)
    assert begins(tmp_path) is None
    with pytest.raises(AttachError, match="is not empty"):
        refuse_unfit(tmp_path, "tank", "c" * 64)


def test_an_attached_plant_is_known_by_the_first_line(tmp_path: Path) -> None:
    assert begins(tmp_path) is None
    attached(tmp_path, closed=False)
    started = begins(tmp_path)
    assert started is not None and started.case == "tank" and started.settings["pace"] == 1.0


@pytest.fixture(scope="session")
def recovered_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run that recovered."""
    return once(tmp_path_factory, "recovered", *RECOVERY, carried_out=homeostat_process).cwd / "run"


def test_a_guard_remembers_the_same_of_what_it_reads(recovered_run: Path) -> None:
    every, read = tuple(read_events(recovered_run)), Found.in_directory(recovered_run, kinds=RECALLED).records
    assert Memory.of(read) == Memory.of(every) and read[-1] == every[-1] and len(read) < len(every)
    assert {record.kind for record in every if record.kind in FOLDED} <= {record.kind for record in read}
    for stated in (every[0].fields["configuration"][:2], [Setting("python", "2.7"), Setting("new", True)]):
        chosen = tuple(s if isinstance(s, Setting) else Setting(s["name"], s["value"]) for s in stated)
        assert changed(read, chosen) == changed(every, chosen)
    modes = [record for record in every if record.kind == ModeEntered.kind]
    assert modes and modes == [record for record in read if record.kind == ModeEntered.kind]


@pytest.mark.parametrize(
    "line", [b'{"x"\n', b"\x9d\xff\n", b"[" * 5000 + b"\n", b"{}\n"], ids=["half", "bytes", "deep", "empty"]
)
def test_a_journal_that_begins_with_no_line_of_one_is_said_so(tmp_path: Path, line: bytes) -> None:
    (tmp_path / "events.jsonl").write_bytes(line)
    with pytest.raises(BrokenChain, match=r"the journal of .* cannot be read: line 1 is not a line that a run writes"):
        begins(tmp_path)


ASKED = [("status",), ("mode", "advise"), ("approve",), ("replay", "--what-if")]


@pytest.mark.parametrize("words", ASKED, ids=[words[0] for words in ASKED])
def test_every_command_says_so_in_one_line(tmp_path: Path, words: tuple[str, ...]) -> None:
    (tmp_path / "live").mkdir()
    (tmp_path / "live" / "events.jsonl").write_bytes(b'{"x"\n')
    refused(homeostat(words[0], "live", *words[1:], cwd=tmp_path), "'live'", "line 1 is not a line that a run writes")
