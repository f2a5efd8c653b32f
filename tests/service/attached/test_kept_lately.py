"""A historian that begins knows what was kept last, whatever clocks and disks say; nothing holds up what follows."""

from __future__ import annotations

import errno
import os
import threading
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.domain.observation import Message, Trouble
from homeostat.history.embedded.layout import RAW, listed
from homeostat.history.embedded.segment import SegmentWriter
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS, NO_TIME, Batch
from homeostat.service.attached.place import HISTORY
from homeostat.service.historian.line import HistoryLine
from homeostat.service.historian.observed import PROCESS_TIME
from homeostat.service.historian.process import Keeping, _identity, _Keeping, _kept_lately

T0 = 1_764_000_000_000_000
YEAR = 365 * 86_400 * 1_000_000
LONG_S = 20.0


def batch(at_us: int, other_us: int, tag: str = "T1") -> Batch:
    """One tag, whose source has a clock of its own, and process time."""
    times = np.array([other_us, at_us], dtype=np.int64)
    none = np.full(2, NO_TIME, dtype=np.int64)
    return Batch((tag, PROCESS_TIME), times, np.zeros(2), np.zeros(2, dtype=np.uint32), none, at_us)


@pytest.mark.parametrize("ahead_us", [0, 10 * YEAR, -10 * YEAR])
def test_one_source_with_a_wrong_clock_hides_nothing_that_was_kept(tmp_path: Path, ahead_us: int) -> None:
    with EmbeddedStore(tmp_path / "h") as store:
        for k in range(5):
            store.append(last := batch(T0 + k, T0 + k + ahead_us))
    with EmbeddedStore(tmp_path / "h") as store:
        assert _identity(last) in _kept_lately(store)


def test_a_damaged_table_does_not_keep_a_historian_from_keeping(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with EmbeddedStore(tmp_path / "h") as store:
        store.append(batch(T0, T0))
    listed(tmp_path / "h", RAW).tables[0].path.write_bytes(b"no table")
    with EmbeddedStore(tmp_path / "h") as store:
        assert _kept_lately(store) == set()
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert "what was kept last cannot be read" in said and "is damaged" in said


def test_what_no_store_takes_is_said_and_what_follows_is_kept(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    messages = list[Message]()
    line = HistoryLine(tmp_path / HISTORY, messages.append)
    reads, pulse = os.pipe()
    line.keep(batch(T0, T0, tag="T\n1"))
    line.keep(batch(T0 + 1, T0 + 1))
    with EmbeddedStore(tmp_path / "h") as store:
        stopping = threading.Event()
        keeping = Keeping(tmp_path, tmp_path / "h", pulse, os.getppid())
        working = threading.Thread(target=_Keeping(keeping, store, stopping).go_on, daemon=True)
        working.start()
        until = time.monotonic() + LONG_S
        while line._waiting and time.monotonic() < until:
            time.sleep(0.01)
        stopping.set()
        working.join(LONG_S)
        assert store.read(["T1"], ALWAYS)["T1"].length == 1
    assert next(m.cause for m in messages if isinstance(m, Trouble)).startswith("one of the samples or events cannot")
    assert "is no name of a tag" in capfd.readouterr().err
    line.close(0.0)
    os.close(reads)
    os.close(pulse)


def test_what_follows_something_that_was_not_kept_does_not_say_that_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stopping, append = threading.Event(), SegmentWriter.append

    def once_broken(segment: SegmentWriter, one: Batch) -> None:
        """A disk that fails once, and by then this process is told to end."""
        if not stopping.is_set():
            stopping.set()
            time.sleep(0.3)  # all of it has been sent
            raise OSError(errno.EIO, "Input/output error")
        append(segment, one)

    monkeypatch.setattr(SegmentWriter, "append", once_broken)
    line = HistoryLine(tmp_path / HISTORY, lambda message: True)
    reads, pulse = os.pipe()
    for k in range(3):
        line.keep(batch(T0 + k, T0 + k))
    with EmbeddedStore(tmp_path / "h") as store:
        _Keeping(Keeping(tmp_path, tmp_path / "h", pulse, os.getppid()), store, stopping).go_on()
        assert store.extent() is None
    assert len(line._waiting) == 3
    line.close(0.0)
    os.close(reads)
    os.close(pulse)
