"""Run directories: taken once, left alone when they are somebody else's, closed with a manifest."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.journal import RunFinished, Summary
from homeostat.journal.beside.archive import Archive
from homeostat.journal.verify.verify import verify
from homeostat.record.directory import RunDirectory, RunDirectoryError


def test_texts_are_kept_once_and_confirmed_by_the_manifest(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "a" / "run") as directory:
        archive: Archive = directory
        first, again = archive.store_query("ASK {}"), archive.store_query("ASK {}")
        answer = archive.store_subgraph("ASK {}")
        directory.store_whole("note.txt", b"hello")
        directory.journal.record(RunFinished("done"), 1.0)
        manifest = directory.close(Summary(1, "done"))
    assert first == again and first.sha256 == answer.sha256
    assert (first.name, answer.name) == (f"queries/{first.sha256}.rq", f"subgraphs/{first.sha256}.ttl")
    assert [f.name for f in manifest.files] == sorted(["note.txt", first.name, answer.name])
    assert verify(directory.path).complete
    (directory.path / first.name).write_text("ASK { }")
    assert (
        verify(directory.path).problem == f"file {first.name!r} was altered: its size or digest is not the manifest's"
    )


def test_a_directory_that_is_not_closed_is_incomplete(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "run") as directory:
        directory.journal.record(RunFinished("done"), 1.0)
    report = verify(tmp_path / "run")
    assert (report.lines, report.intact, report.complete) == (2, True, False)  # the event and its signature


def test_an_empty_directory_is_used_and_a_full_one_is_not(tmp_path: Path) -> None:
    with RunDirectory(tmp_path):
        pass
    with pytest.raises(RunDirectoryError, match="is not empty"):
        RunDirectory(tmp_path)


def test_what_cannot_be_made_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path in (tmp_path / "file" / "run", tmp_path / "new" / ("x" * 300)):
        with pytest.raises(OSError):
            RunDirectory(path)
    assert [path.name for path in tmp_path.rglob("*")] == ["file"]


def test_the_next_free_name(tmp_path: Path) -> None:
    for name in ("run", "run-2", "run-3"):
        with RunDirectory.next_free(tmp_path / "runs", "run") as directory:
            assert directory.path == tmp_path / "runs" / name
