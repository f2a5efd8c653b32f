"""The ledger: whatever happens to its file, rows that are whole are kept, and nothing else is."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.ledger import LEDGER, Ledger, in_order
from homeostat.record.row import Row
from tests.cli.command import environment
from tests.evaluate.study.fake_rows import campaign

ROWS = {f"print-{number}": row for number, row in enumerate(campaign(range(1, 2))[:5])}


def filled(folder: Path, rows: dict[str, Row] = ROWS) -> bytes:
    with Ledger(folder) as ledger:
        for fingerprint, row in rows.items():
            ledger.add(fingerprint, row)
    return (folder / LEDGER).read_bytes()


def read(folder: Path) -> dict[str, Row]:
    with Ledger(folder) as ledger:
        return dict(ledger.rows)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return filled(tmp_path_factory.mktemp("ledger"))


def test_rows_come_back_as_they_were(tmp_path: Path) -> None:
    filled(tmp_path)
    assert read(tmp_path) == ROWS
    with Ledger(tmp_path) as ledger:
        assert in_order(["print-3", "nobody", "print-0"], ledger) == [ROWS["print-3"], ROWS["print-0"]]


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(share=st.floats(0.0, 1.0))
def test_a_cut_anywhere_loses_the_last_row_at_most(whole: bytes, tmp_path: Path, share: float) -> None:
    cut = round(share * len(whole))
    (tmp_path / LEDGER).write_bytes(whole[:cut])
    complete = whole[:cut].count(b"\n")
    assert list(read(tmp_path)) == list(ROWS)[:complete]
    # What is added after a cut begins on a line of its own.
    with Ledger(tmp_path) as ledger:
        ledger.add("new", ROWS["print-0"])
    assert list(read(tmp_path)) == [*list(ROWS)[:complete], "new"]


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    junk=st.binary(max_size=40) | st.from_regex(r"[\[\]{}0-9nul\",: ]{0,20}", fullmatch=True).map(str.encode),
    at=st.integers(0, 5),
)
def test_a_garbage_line_costs_nothing_else(whole: bytes, tmp_path: Path, junk: bytes, at: int) -> None:
    lines = whole.splitlines(keepends=True)
    (tmp_path / LEDGER).write_bytes(b"".join([*lines[:at], junk + b"\n", *lines[at:]]))
    assert read(tmp_path) == ROWS


@pytest.mark.parametrize(
    "junk", ["3", "null", '"text"', "[]", "{}", "NaN", "[" * 100_000, '{"fingerprint": "x"}', "true"]
)
def test_lines_that_are_json_and_no_row(whole: bytes, tmp_path: Path, junk: str) -> None:
    (tmp_path / LEDGER).write_bytes(junk.encode() + b"\n" + whole)
    assert read(tmp_path) == ROWS


def test_a_row_of_other_columns_is_made_again(whole: bytes, tmp_path: Path) -> None:
    first, *rest = whole.splitlines(keepends=True)
    for change in ({"of_tomorrow": 1}, {"severity": 3}, {"severity": None}):
        (tmp_path / LEDGER).write_bytes(json.dumps({**json.loads(first), **change}).encode() + b"\n" + b"".join(rest))
        assert list(read(tmp_path)) == list(ROWS)[1:]
    less = {k: v for k, v in json.loads(first).items() if k != "kind"}
    (tmp_path / LEDGER).write_bytes(json.dumps(less).encode() + b"\n" + b"".join(rest))
    assert list(read(tmp_path)) == list(ROWS)[1:]


def test_the_newest_row_of_a_job_counts(tmp_path: Path) -> None:
    filled(tmp_path)
    filled(tmp_path, {"print-1": ROWS["print-4"]})
    assert read(tmp_path)["print-1"] == ROWS["print-4"]


def test_a_second_campaign_is_refused_in_this_process_and_in_another(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path\n"
        "from homeostat.evaluate.study.ledger import Ledger\n"
        "from homeostat.evaluate.study.error import StudyError\n"
        "try:\n    Ledger(Path(sys.argv[1]))\nexcept StudyError as error:\n    print(error)\n"
    )

    def other() -> str:
        arguments = [sys.executable, "-c", code, str(tmp_path)]
        return subprocess.run(
            arguments, env=environment(), capture_output=True, text=True, timeout=240, check=True
        ).stdout

    with Ledger(tmp_path) as ledger:
        ledger.add("print-0", ROWS["print-0"])
        with pytest.raises(StudyError, match="is in use by another study; wait for it or choose --out"):
            Ledger(tmp_path)
        assert "is in use by another study" in other()
    assert other() == ""
    assert read(tmp_path) == {"print-0": ROWS["print-0"]}


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    for folder in (tmp_path / "file", tmp_path / "file" / "below", Path("/proc/homeostat")):
        with pytest.raises(OSError) as refused:
            Ledger(folder)
        assert refused.value.filename is not None
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("taken", [0, 1, 100])
def test_a_full_disk_loses_nothing_that_was_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, taken: int) -> None:
    """The disk takes ``taken`` bytes of the third row, and then nothing."""
    write, left = os.write, [taken]

    def full(file: int, data: bytes) -> int:
        if not left[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        given, left[0] = left[0], 0
        return write(file, data[:given])

    names = list(ROWS)
    with Ledger(tmp_path) as ledger:
        for name in names[:2]:
            ledger.add(name, ROWS[name])
        with monkeypatch.context() as patch:
            patch.setattr(os, "write", full)
            with pytest.raises(OSError, match="No space left") as refused:
                ledger.add(names[2], ROWS[names[2]])
        assert refused.value.filename == str(tmp_path / LEDGER)
        assert list(ledger.rows) == names[:2]
    assert list(read(tmp_path)) == names[:2]
    with Ledger(tmp_path) as ledger:
        ledger.add(names[2], ROWS[names[2]])
    assert list(read(tmp_path)) == names[:3]


def test_a_disk_that_takes_little_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = os.write
    monkeypatch.setattr(os, "write", lambda file, data: write(file, data[:7]))
    filled(tmp_path)
    monkeypatch.undo()
    assert read(tmp_path) == ROWS


def test_a_torn_row_does_not_spoil_the_next_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = os.write

    def torn(file: int, data: bytes) -> int:
        if len(data) <= 50:
            raise OSError(errno.EIO, "Input/output error")
        return write(file, data[: len(data) - 50])

    with Ledger(tmp_path) as ledger:
        with monkeypatch.context() as patch:
            patch.setattr(os, "write", torn)
            with pytest.raises(OSError):
                ledger.add("print-0", ROWS["print-0"])
        ledger.add("print-1", ROWS["print-1"])
    assert read(tmp_path) == {"print-1": ROWS["print-1"]}


def test_nothing_is_left_of_a_campaign_that_never_began(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    for folder, stays in ((tmp_path / "new", False), (tmp_path / "there", True)):
        with pytest.raises(StudyError, match="no scheduler"), Ledger(folder):
            raise StudyError("no scheduler")
        assert folder.exists() == stays and not list(tmp_path.rglob("*.jsonl"))
    filled(tmp_path / "new")
    with pytest.raises(StudyError), Ledger(tmp_path / "new"):
        raise StudyError("no scheduler")
    assert read(tmp_path / "new") == ROWS


def test_who_waited_for_a_ledger_that_went_writes_where_all_look(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, real = Ledger(tmp_path), os.open

    def opened(path: Path, *options: int) -> int:
        file = real(path, *options)
        monkeypatch.setattr(os, "open", real)
        before.__exit__(None, None, None)  # between the opening and the lock, the other one leaves
        return file

    monkeypatch.setattr(os, "open", opened)
    filled(tmp_path)
    assert read(tmp_path) == ROWS
