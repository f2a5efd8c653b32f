"""Recorded runs: shown again, verified, and caught when they were altered."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest

from homeostat.domain import events
from homeostat.journal import read_events
from homeostat.record.decode import EVENTS, decode
from homeostat.record.events import declared
from tests.cli.command import Done, homeostat, refused


@pytest.mark.quick
def test_a_replay_shows_what_the_run_showed(recovered: Done) -> None:
    again = homeostat("replay", "run", cwd=recovered.cwd)
    assert (again.status, again.out, again.err) == (0, recovered.out, "")


@pytest.mark.slow
def test_a_replay_as_json(recovered_json: Done) -> None:
    again = homeostat("replay", "run", "--json", cwd=recovered_json.cwd)
    assert (again.status, again.out, again.err) == (0, recovered_json.out, "")


def test_a_complete_run_verifies(recovered: Done, record: Path) -> None:
    done = homeostat("trace", "verify", "run", cwd=recovered.cwd)
    lines = (record / "events.jsonl").read_bytes().count(b"\n")
    words = f"run: complete and unaltered, {lines} events; signed by trusted key "
    assert (done.status, done.err) == (0, "") and done.out.startswith(words) and done.out.count("\n") == 1


def flip(path: Path) -> None:
    """Change one byte in the middle of a file."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def misquote(path: Path) -> None:
    """Change one digit of a number in the middle of a file: it can be read as before, and says something else."""
    content = bytearray(path.read_bytes())
    digit = re.compile(rb":(\d)").search(content, len(content) // 2)
    assert digit is not None
    content[digit.start(1)] ^= 1
    path.write_bytes(content)


def cut(path: Path) -> None:
    """Take the last line of a file away."""
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("events.jsonl", flip, "ALTERED: line "),
        ("events.jsonl", cut, "ALTERED: the journal ends"),
        ("events.jsonl", Path.unlink, "ALTERED: 'run' holds no events.jsonl"),
        ("manifest.json", flip, "ALTERED: manifest.json was altered"),
        ("manifest.json", Path.unlink, "incomplete run"),
        ("trajectory.parquet", flip, "ALTERED: file 'trajectory.parquet' was altered"),
        ("result.json", Path.unlink, "ALTERED: file 'result.json' is missing"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_an_altered_run_is_caught(
    tmp_path: Path, record: Path, name: str, change: Callable[[Path], None], words: str
) -> None:
    shutil.copytree(record, tmp_path / "run")
    change(tmp_path / "run" / name)
    done = homeostat("trace", "verify", "run", cwd=tmp_path)
    assert (done.status, done.err) == (1, "")
    assert done.out.startswith("run: ") and words in done.out and done.out.count("\n") == 1


def test_a_replay_of_an_altered_run_says_so(tmp_path: Path, recovered: Done, record: Path) -> None:
    shutil.copytree(record, tmp_path / "run")
    misquote(tmp_path / "run" / "events.jsonl")
    done = homeostat("replay", "run", cwd=tmp_path)
    assert done.status == 1 and done.err.count("\n") == 1 and "altered" in done.err
    assert recovered.out.startswith(done.out) and "Recovered" not in done.out


@pytest.mark.parametrize("command", [("replay",), ("trace", "verify")], ids=" ".join)
@pytest.mark.parametrize("place", ["missing", "file", "empty"])
def test_what_is_no_run_is_refused(tmp_path: Path, command: tuple[str, ...], place: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    refused(homeostat(*command, place, cwd=tmp_path), f"'{place}'", "directory")


def test_a_result_that_is_none_is_refused(tmp_path: Path, record: Path) -> None:
    shutil.copytree(record, tmp_path / "run")
    (tmp_path / "run" / "result.json").write_text('{"case": 1}')
    refused(homeostat("replay", "run", "--json", cwd=tmp_path), "result.json", "verify")


def test_every_event_of_a_run_is_recalled(record: Path) -> None:
    known = {event.kind for event in EVENTS}
    records = list(read_events(record))
    assert {r.kind for r in records} <= known
    events = [decode(r) for r in records]
    assert [e.kind for e in events if e is not None] == [r.kind for r in records]


def test_every_event_can_be_recalled() -> None:
    """In whichever file of the package it is declared."""
    files = [import_module(f"{events.__name__}.{one.name}") for one in iter_modules(events.__path__)]
    found = {event for file in files for event in declared(file)}
    assert len(files) > 5 and found <= set(EVENTS) and {"Diagnosed", "Deviated"} <= {event.__name__ for event in found}
