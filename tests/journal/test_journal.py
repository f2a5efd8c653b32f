"""The journal on a real disk: closing, refusing, running out of room, repeating."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from homeostat import __version__
from homeostat.journal import Journal, RunFinished, Summary, read_events
from homeostat.journal.beside.manifest import read_manifest
from homeostat.journal.verify.verify import verify
from tests.equipment.journals import timeless
from tests.journal.samples import Measured, write_open_run, write_run

pytestmark = pytest.mark.quick


def test_the_manifest_tells_what_the_run_is(tmp_path: Path) -> None:
    manifest = write_run(tmp_path, events=4)
    journal = (tmp_path / "events.jsonl").read_bytes()
    assert (manifest.format, manifest.homeostat, manifest.seed, manifest.outcome) == (3, __version__, 7, "released")
    assert manifest.events == journal.count(b"\n") == 6
    assert manifest.last == hashlib.sha256(journal.splitlines()[-1]).hexdigest()
    (query,) = manifest.files
    content = (tmp_path / query.name).read_bytes()
    assert (query.size_bytes, query.sha256) == (len(content), hashlib.sha256(content).hexdigest())
    assert query.name == f"queries/{query.sha256}.rq"
    assert read_manifest(tmp_path) == manifest


def test_the_same_run_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    assert write_run(tmp_path / "a") == write_run(tmp_path / "b")
    for name in ("events.jsonl", "manifest.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_only_wall_fields_differ_on_a_slower_machine(tmp_path: Path) -> None:
    write_run(tmp_path / "fast", wall_latency_s=0.1)
    write_run(tmp_path / "slow", wall_latency_s=9.0)
    fast, slow = (list(read_events(tmp_path / name)) for name in ("fast", "slow"))
    assert fast != slow
    assert [timeless(record) for record in fast] == [timeless(record) for record in slow]


def test_a_directory_holds_one_run(tmp_path: Path) -> None:
    write_run(tmp_path)
    before = (tmp_path / "events.jsonl").read_bytes()
    with pytest.raises(FileExistsError, match="already holds a run; choose another directory"):
        Journal(tmp_path)
    assert (tmp_path / "events.jsonl").read_bytes() == before


def test_a_closed_journal_takes_nothing_more(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.close(Summary(1, "no-fault"))
    for late in (
        lambda: journal.record(RunFinished("late"), 0.0),
        journal.sync,
        lambda: journal.close(Summary(1, "x")),
    ):
        with pytest.raises(ValueError, match=r"events\.jsonl' is closed; record before closing it"):
            late()
    assert verify(tmp_path).complete


def test_a_run_left_by_an_exception_is_intact_but_incomplete(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), Journal(tmp_path) as journal:
        journal.record(Measured("T1", 1.0), 0.0)
        raise ZeroDivisionError
    report = verify(tmp_path)
    assert (report.lines, report.complete, report.intact) == (1, False, True)
    assert report.problem == "incomplete run: verifies up to line 1"
    with pytest.raises(ValueError, match="is closed"):
        journal.record(Measured("T1", 2.0), 1.0)


FULL_DISK = """
import resource, sys
from homeostat.journal import Journal
from homeostat.journal.beside.artifacts import write_text
from tests.equipment.journals import timeless
from tests.journal.samples import Measured
journal = Journal(sys.argv[1])
journal.record(Measured("T1", 0.0), 0.0)
size = (journal.directory / "events.jsonl").stat().st_size
resource.setrlimit(resource.RLIMIT_FSIZE, (size + 40, resource.RLIM_INFINITY))
for attempt in range(2):
    try:
        journal.record(Measured("T1", 1.0), 1.0)
    except OSError as error:
        print(error)
try:
    write_text(journal.directory / "queries", "x" * 2 * size, ".rq")
except OSError as error:
    print("text:", error)
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
journal.record(Measured("T1", 2.0), 2.0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit on file size")
def test_a_full_disk_leaves_no_torn_line_and_no_torn_file(tmp_path: Path) -> None:
    repo = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-c", FULL_DISK, str(tmp_path / "run")]
    done = subprocess.run(command, cwd=repo, capture_output=True, text=True, timeout=240, check=True)
    assert done.stdout.count("only 40 of ") == 2 and "fit on the disk; make room" in done.stdout
    assert "text: [Errno" in done.stdout and not list((tmp_path / "run" / "queries").iterdir())
    assert [record.fields["value"] for record in read_events(tmp_path / "run")] == [0.0, 2.0]
    assert verify(tmp_path / "run").problem == "incomplete run: verifies up to line 2"


def test_lines_are_canonical_json(tmp_path: Path) -> None:
    write_open_run(tmp_path)
    for number, line in enumerate((tmp_path / "events.jsonl").read_text("ascii").splitlines(), start=1):
        content = json.loads(line)
        assert json.dumps(content, separators=(",", ":")) == line
        assert list(content)[:4] == ["seq", "prev", "at_s", "event"] and content["seq"] == number
