"""The store in a folder keeps the contract, and its own promises: recovery, files, locks, retention, a full disk."""

from __future__ import annotations

import itertools
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.history.embedded import reading
from homeostat.history.embedded.layout import MARK, segments_of
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.records import HEADER, Kind, Record, framed, scan
from homeostat.history.embedded.sealing import seal
from homeostat.history.embedded.segment import read_segment
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS
from homeostat.history.store import HistoryError
from tests.contracts.history_store import T0, HistoryStoreContract, Open, S, batch, plain, rows_of

MEMORY = Path("/dev/shm") if Path("/dev/shm").is_dir() else None
"""Where many stores are made: a disk takes its time for each file that must be safe."""


class TestEmbedded(HistoryStoreContract):
    """The contract."""

    @pytest.fixture
    def opened(self, tmp_path: Path) -> Open:
        return lambda: EmbeddedStore(tmp_path / "history")

    @pytest.fixture
    def anew(self) -> Iterator[Callable[[], Open]]:
        numbers = itertools.count()
        with tempfile.TemporaryDirectory(dir=MEMORY) as base:
            yield lambda: partial(EmbeddedStore, Path(base) / str(next(numbers)))

    @pytest.fixture
    def reader(self, tmp_path: Path) -> Callable[[], EmbeddedHistory]:
        return lambda: EmbeddedHistory(tmp_path / "history")


def test_two_processes_cannot_write_one_store_and_the_second_is_told_who_does(tmp_path: Path) -> None:
    store = EmbeddedStore(tmp_path)
    with pytest.raises(HistoryError, match=rf"is written by process {os.getpid()}; end that one first, or choose"):
        EmbeddedStore(tmp_path)
    store.close()
    EmbeddedStore(tmp_path).close()


def test_a_folder_with_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("...")
    with pytest.raises(HistoryError, match=r"is no history, and holds 'thesis.tex'; choose a new or empty directory"):
        EmbeddedStore(tmp_path)
    with pytest.raises(HistoryError, match=r"is no history; 'homeostat run CASE --history DIR' makes one"):
        EmbeddedHistory(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_history_of_another_format_is_not_touched(tmp_path: Path) -> None:
    EmbeddedStore(tmp_path).close()
    (tmp_path / MARK).write_text("7\n")
    for open_ in (EmbeddedStore, EmbeddedHistory):
        with pytest.raises(HistoryError, match="is a history of format '7'; this version reads 1"):
            open_(tmp_path)


def left_behind(folder: Path, batches: int = 20) -> Path:
    """The log of a store whose process ended without closing it, ``batches`` seconds of two tags."""
    store = EmbeddedStore(folder)
    for k in range(batches):
        store.append(batch(plain("T1", T0 + k * S, k * 1.5), plain("L1", T0 + k * S, k * 2.5), own_us=T0 + k * S))
    store.sync()
    copied = folder.parent / "left behind"
    shutil.copytree(folder, copied)
    store.close()
    [log] = (copied / "log").iterdir()
    return log


@settings(max_examples=40, deadline=None)
@given(cut=st.integers(1, 400))
def test_a_torn_tail_is_cut_off_and_told_and_everything_before_it_is_there(cut: int) -> None:
    with tempfile.TemporaryDirectory(dir=MEMORY) as base:
        log = left_behind(Path(base) / "history")
        raw = log.read_bytes()
        log.write_bytes(raw[: len(raw) - cut])
        with EmbeddedStore(log.parents[1]) as store:
            kept = store.read(["T1"], ALWAYS)["T1"]
            troubles, events = store.take_troubles(), store.occurrences(ALWAYS)
            assert kept.value.tolist() == [k * 1.5 for k in range(kept.length)] and 13 < kept.length < 20
            assert store.read(["L1"], ALWAYS)["L1"].length == kept.length
        whole = record_ends(raw)
        if len(raw) - cut in whole:  # a cut between two records cannot be told from a shorter log
            assert troubles == ()
        else:
            assert len(troubles) == 1 and "the last record was torn and is cut off" in troubles[0]
            assert [event.text for event in events] == list(troubles)


def record_ends(raw: bytes) -> set[int]:
    """Where the records of a log end."""
    ends, at = set(), len(HEADER)
    for found in scan(raw):
        at += len(framed(Kind.TAGS, b"")) + len(found.content) if isinstance(found, Record) else found.length
        ends.add(at)
    return ends


@settings(max_examples=60, deadline=None)
@given(at=st.floats(0.0, 1.0), flipped=st.integers(1, 255))
def test_a_byte_that_changed_costs_one_record_and_is_told(at: float, flipped: int) -> None:
    with tempfile.TemporaryDirectory(dir=MEMORY) as base:
        log = left_behind(Path(base) / "history")
        raw = bytearray(log.read_bytes())
        raw[int(at * (len(raw) - 1))] ^= flipped
        log.write_bytes(raw)
        with EmbeddedStore(log.parents[1]) as store:
            troubles = store.take_troubles()
            known = store.tags()
            rows = store.read(["T1"], ALWAYS)["T1"].value.tolist() if known else []
        every = [k * 1.5 for k in range(20)]
        assert troubles and set(rows) <= set(every) and sorted(rows) == rows
        # Where the names are lost nothing can be said of the samples, and that is told as well.
        assert len(rows) >= 19 or (not known and any("lost the names of their tags" in line for line in troubles))


@pytest.mark.parametrize("when", ["read_names", "segments_of"])
def test_names_are_known_while_a_log_becomes_a_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    """Whoever writes seals everything just before or just after a reader looks for names, in either of two places."""
    log = left_behind(tmp_path / "history")
    seen, own = EmbeddedHistory(log.parents[1]), getattr(reading, when)

    def sealed_meanwhile(folder: Path) -> object:
        found = own(folder)
        EmbeddedStore(folder).close()
        return found

    monkeypatch.setattr(reading, when, sealed_meanwhile)
    assert seen.tags() == ("L1", "T1") and not log.exists()
    assert seen.read(["T1"], ALWAYS)["T1"].length == 20


def test_a_store_that_was_killed_while_it_made_tables_reads_the_same(tmp_path: Path) -> None:
    log = left_behind(tmp_path / "history")
    store, number = log.parents[1], segments_of(log.parents[1])[0]
    expected = rows_of(EmbeddedHistory(store).read(["T1"], ALWAYS)["T1"])
    content = read_segment(log)
    seal(store, number, content)  # and the log is still there
    (store / "raw" / "2026.partial").write_bytes(b"PAR1")
    assert rows_of(EmbeddedHistory(store).read(["T1"], ALWAYS)["T1"]) == expected
    with EmbeddedStore(store) as again:
        assert rows_of(again.read(["T1"], ALWAYS)["T1"]) == expected and again.take_troubles() == ()
    assert not list((store / "log").iterdir()) and not list((store / "raw").glob("*.partial"))
    assert rows_of(EmbeddedHistory(store).read(["T1"], ALWAYS)["T1"]) == expected
    assert EmbeddedHistory(store).minutes(["T1"], ALWAYS)["T1"].count.sum() == 20
