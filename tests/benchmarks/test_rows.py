"""Rows of a study go with the project, and come back where the study looks for them."""

from __future__ import annotations

import io
import tarfile
from pathlib import Path

import pytest

from benchmarks.rows import archive_of, pack, unpack

LINES = '{"run": 1}\n{"run": 2}\n'


def study(root: Path, text: str = LINES) -> Path:
    path = root / "build" / "unknown" / "judged-abc.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_what_was_packed_is_there_again(tmp_path: Path) -> None:
    path = study(tmp_path)
    assert pack("unknown", ["build/unknown/*.jsonl"], tmp_path) == [path]
    path.unlink()
    assert unpack("unknown", tmp_path) == [path]
    assert path.read_text() == LINES


def test_the_same_rows_are_the_same_bytes(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        study(tmp_path / folder)
        pack("unknown", ["build/**/*.jsonl"], tmp_path / folder)
    assert archive_of("unknown", tmp_path / "a").read_bytes() == archive_of("unknown", tmp_path / "b").read_bytes()


@pytest.mark.parametrize(
    ("since", "after"), [(LINES + '{"run": 3}\n', LINES + '{"run": 3}\n'), ('{"run": 1}\n', LINES)]
)
def test_a_file_that_went_on_stays_and_one_that_is_behind_does_not(tmp_path: Path, since: str, after: str) -> None:
    study(tmp_path)
    pack("unknown", ["build/unknown/*.jsonl"], tmp_path)
    path = study(tmp_path, since)
    unpack("unknown", tmp_path)
    assert path.read_text() == after


def test_nothing_to_pack_drops_nothing(tmp_path: Path) -> None:
    study(tmp_path)
    pack("unknown", ["build/unknown/*.jsonl"], tmp_path)
    kept = archive_of("unknown", tmp_path).read_bytes()
    with pytest.raises(FileNotFoundError, match=r"nothing/\*"):
        pack("unknown", ["nothing/*"], tmp_path)
    assert archive_of("unknown", tmp_path).read_bytes() == kept


def test_an_archive_writes_nothing_outside_the_project(tmp_path: Path) -> None:
    root = tmp_path / "project"
    at = archive_of("bad", root)
    at.parent.mkdir(parents=True)
    with tarfile.open(at, "w:xz") as archive:
        entry = tarfile.TarInfo("../outside.jsonl")
        entry.size = 2
        archive.addfile(entry, io.BytesIO(b"{}"))
    with pytest.raises(ValueError, match="outside the project"):
        unpack("bad", root)
    assert not (tmp_path / "outside.jsonl").exists()


def test_a_study_of_which_nothing_is_kept_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="nothing is kept of a study 'unknwon'"):
        unpack("unknwon", tmp_path)
