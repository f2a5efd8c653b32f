"""A full disk while hours are joined: the room that they hold is waited for, for some seconds, and nothing is lost."""

from __future__ import annotations

import errno
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from homeostat.history.embedded import retention, tidying
from homeostat.history.embedded.layout import RAW, TableFile, listed
from homeostat.history.embedded.retention import with_room
from homeostat.history.embedded.segment import SegmentWriter
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS, Batch
from homeostat.history.store import HistoryError
from tests.contracts.history_store import T0, S, batch, plain

LONG_S = 20.0
"""Far beyond what any of this takes [s]."""


class Disk:
    """A disk that is full until something is over, and the joining of an hour that holds its room."""

    def __init__(self) -> None:
        self.full, self.joining, self.over = False, threading.Event(), threading.Event()
        self.tried = threading.Event()

    def join(self, store: Path, label: str) -> None:
        self.joining.set()
        self.over.wait(LONG_S)
        self.full = False

    def writes(self, write: Callable[[SegmentWriter, Batch], None]) -> Callable[[SegmentWriter, Batch], None]:
        def written(segment: SegmentWriter, one: Batch) -> None:
            if self.full:
                self.tried.set()
                raise OSError(errno.ENOSPC, "No space left on device")
            write(segment, one)

        return written


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Disk]:
    made = Disk()
    monkeypatch.setattr(SegmentWriter, "append", made.writes(SegmentWriter.append))
    monkeypatch.setattr(tidying, "compact", made.join)
    yield made
    made.over.set()


def sample(k: int) -> Batch:
    return batch(plain("T1", T0 + k * S, float(k)), own_us=T0 + k * S)


def full_while_joining(folder: Path, disk: Disk) -> EmbeddedStore:
    """A store that has taken two samples, whose disk is full now, and which joins an hour."""
    store = EmbeddedStore(folder)
    assert disk.joining.wait(LONG_S)
    store.append(sample(0))
    store.append(sample(1))
    disk.full = True
    return store


def kept(store: EmbeddedStore) -> list[float]:
    return list(store.read(["T1"], ALWAYS)["T1"].value.tolist())


def beside(work: Callable[[], None]) -> tuple[threading.Thread, list[BaseException]]:
    """``work`` in another thread, and what it raises."""
    raised = list[BaseException]()

    def run() -> None:
        try:
            work()
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, raised


def test_a_sample_waits_for_the_joining_that_holds_the_room(tmp_path: Path, disk: Disk) -> None:
    store = full_while_joining(tmp_path, disk)
    thread, raised = beside(lambda: store.append(sample(2)))
    assert disk.tried.wait(LONG_S) and thread.is_alive()
    began_s = time.monotonic()
    store.sync()  # what was acknowledged before is safe from a power cut all the same
    assert time.monotonic() - began_s < 2.0 and kept(store) == [0.0, 1.0]
    disk.over.set()
    thread.join(LONG_S)
    assert not thread.is_alive() and raised == [] and kept(store) == [0.0, 1.0, 2.0]
    store.close()
    with EmbeddedStore(tmp_path) as again:
        assert kept(again) == [0.0, 1.0, 2.0]


def test_where_the_joining_never_ends_the_sample_is_refused_and_the_others_stay(
    tmp_path: Path, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(retention, "WAIT_S", 0.3)
    store = full_while_joining(tmp_path, disk)
    began_s = time.monotonic()
    with pytest.raises(OSError, match="No space left"):
        store.append(sample(2))
    assert 0.25 <= time.monotonic() - began_s < 5.0
    assert kept(store) == [0.0, 1.0], "of what was refused nothing is kept"
    disk.over.set()
    while disk.full:
        time.sleep(0.01)
    store.append(sample(3))
    store.close()
    with EmbeddedStore(tmp_path) as again:
        assert kept(again) == [0.0, 1.0, 3.0]


def test_a_store_that_is_closed_meanwhile_refuses_what_waits(tmp_path: Path, disk: Disk) -> None:
    store = full_while_joining(tmp_path, disk)
    thread, raised = beside(lambda: store.append(sample(2)))
    assert disk.tried.wait(LONG_S)
    closing, failed = beside(store.close)
    while store._open:
        time.sleep(0.01)
    disk.over.set()
    thread.join(LONG_S)
    closing.join(LONG_S)
    assert failed == [] and [type(error) for error in raised] == [HistoryError]
    with EmbeddedStore(tmp_path) as again:
        assert kept(again) == [0.0, 1.0]


def test_the_wait_is_a_few_seconds() -> None:
    assert 1.0 <= retention.WAIT_S <= 10.0


# --- what is dropped meanwhile ----------------------------------------------------------------------------------


def tables(store: Path, hours: int) -> tuple[TableFile, ...]:
    """So many empty tables of samples, an hour each."""
    (store / RAW).mkdir(parents=True)
    for k in range(1, hours + 1):
        TableFile(k, k, f"2026-11-25T{k:02d}", 0, 1, store / RAW).path.touch()
    return listed(store, RAW).tables


class Full:
    """Work for which there is room once ``room`` says so, and a joining that ends when it has been waited for."""

    def __init__(self, room: Callable[[], bool], joinings: int = 0) -> None:
        self._room, self._joinings = room, joinings
        self.tries, self.waits, self.told = 0, list[float](), list[str]()

    @property
    def joined(self) -> bool:
        return self._joinings == 0

    def work(self) -> str:
        self.tries += 1
        if self.tries > 50:
            raise AssertionError("it tries for ever")
        if not self._room():
            raise OSError(errno.ENOSPC, "No space left on device")
        return "written"

    def ended(self, within_s: float) -> bool:
        self.waits.append(within_s)
        if self._joinings == 0 or within_s == 0.0:
            return False
        self._joinings -= 1
        return True

    def run(self, store: Path) -> str:
        return with_room(store, self.work, self.told.append, self.ended)


def test_what_a_joining_reads_is_not_dropped_table_by_table_in_vain(tmp_path: Path) -> None:
    """Its room comes back when the joining has ended: of five hours one goes."""
    first, *others = tables(tmp_path, 5)
    one = Full(lambda: one.joined, joinings=1)
    assert one.run(tmp_path) == "written" and listed(tmp_path, RAW).tables == tuple(others)
    assert len(one.told) == 1 and first.label in one.told[0] and one.waits == [pytest.approx(retention.WAIT_S)]


def test_where_nothing_is_joined_tables_go_until_there_is_room(tmp_path: Path) -> None:
    tables(tmp_path, 5)
    one = Full(lambda: len(listed(tmp_path, RAW).tables) <= 2)
    began_s = time.monotonic()
    assert one.run(tmp_path) == "written" and len(listed(tmp_path, RAW).tables) == 2 and len(one.told) == 3
    assert time.monotonic() - began_s < 2.0


def test_where_nothing_is_left_it_is_tried_once_more_and_given_up(tmp_path: Path) -> None:
    """The joining may have ended between the try and the question whether there is one."""
    tables(tmp_path, 2)
    never = Full(lambda: False)
    with pytest.raises(OSError, match="No space left"):
        never.run(tmp_path)
    assert never.tries == 4 and listed(tmp_path, RAW).tables == ()
    just = Full(lambda: just.tries == 2)
    assert just.run(tmp_path) == "written"


def test_one_joining_after_the_other_is_not_waited_for_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_s = iter(range(1000))
    monkeypatch.setattr(retention, "time", SimpleNamespace(monotonic=lambda: float(next(now_s))))
    one = Full(lambda: False, joinings=1000)
    with pytest.raises(OSError, match="No space left"):
        one.run(tmp_path)
    assert one.waits[0] == retention.WAIT_S and one.waits[-1] == 0.0 and len(one.waits) <= retention.WAIT_S + 2


def test_another_error_is_told_at_once(tmp_path: Path) -> None:
    def work() -> None:
        raise OSError(errno.EIO, "Input/output error")

    with pytest.raises(OSError, match="Input/output error"):
        with_room(tmp_path, work, lambda line: None, lambda within_s: pytest.fail("nothing is waited for"))
