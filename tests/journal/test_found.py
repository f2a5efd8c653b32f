"""A journal is gone on with after one reading: what that finds is what several readings would."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.journal import Journal, Summary, read_events
from homeostat.journal.chain import GENESIS
from homeostat.journal.found import Found
from homeostat.journal.signing.keys import SigningKey
from tests.journal.forgery import lines_of
from tests.journal.samples import Measured, write_open_run

OWN = SigningKey(b"o" * 32)
KINDS = ((), ("measured",), ("run-started", "measured"), ("signed",), ("no such kind",))


@pytest.mark.parametrize("kinds", KINDS)
@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize("torn", [b"", b'{"seq":9,"pre'])
def test_one_reading_finds_what_several_do(tmp_path: Path, kinds: tuple[str, ...], signed: bool, torn: bytes) -> None:
    key = OWN if signed else None
    with Journal(tmp_path, key) as journal:
        for number in range(5):
            journal.record(Measured("T1", float(number)), float(number))
    path = tmp_path / "events.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole + torn)
    found = Found.in_directory(tmp_path, key, kinds)
    assert found.records == tuple(read_events(tmp_path, kinds))
    assert (found.count, found.size, found.at_s) == (5 + signed, len(whole), 4.0)
    assert found.trusted == (6 if signed else 0)
    with Journal.go_on(found, key):
        pass
    assert path.read_bytes().startswith(whole)
    after = lines_of(tmp_path)[found.count]
    assert (after["event"], after["seq"], after["prev"]) == ("resumed", found.count + 1, found.last)
    assert (after["lines"], after["signed"], after["torn"]) == (found.count, found.trusted, bool(torn))


def test_nothing_was_written_yet(tmp_path: Path) -> None:
    (tmp_path / "events.jsonl").write_bytes(b"")
    found = Found.in_directory(tmp_path)
    assert (found.count, found.size, found.last, found.records) == (0, 0, GENESIS, ())
    with Journal.go_on(found):
        pass
    assert lines_of(tmp_path)[0]["at_s"] == 0.0


def test_a_run_that_was_closed_meanwhile_is_not_gone_on_with(tmp_path: Path) -> None:
    write_open_run(tmp_path)
    found = Found.in_directory(tmp_path)
    Journal.resume(tmp_path).close(Summary(1, "stopped", "c" * 64))
    with pytest.raises(FileExistsError, match="was closed"):
        Journal.go_on(found)
