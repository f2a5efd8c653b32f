"""A trace that tells of everything and stores what there is room for, in order."""

from __future__ import annotations

import pytest

from homeostat.domain.ports import Kept
from homeostat.journal import Event, Followed, MemoryTrace
from tests.journal.samples import Measured


class Disk:
    """A trace in memory that may be full."""

    def __init__(self) -> None:
        self.inner, self.full = MemoryTrace(), False

    def record(self, event: Event, at_s: float) -> None:
        if self.full:
            raise OSError("make room")
        self.inner.record(event, at_s)

    def sync(self) -> None:
        if self.full:
            raise OSError("make room")

    def subscribe(self, subscriber: object) -> None:
        raise AssertionError("who follows must not depend on what is stored")

    @property
    def stored(self) -> list[float]:
        return [entry.at_s for entry in self.inner.entries]


def followed(most: int = 10) -> tuple[Disk, Followed, list[float]]:
    disk, told = Disk(), list[float]()
    trace = Followed(disk, most)
    trace.subscribe(lambda event, at_s: told.append(at_s))
    return disk, trace, told


def record(trace: Followed, at_s: float) -> None:
    trace.record(Measured("T1", at_s), at_s)


def test_followers_are_told_once_of_what_finds_no_room_and_it_is_stored_later_in_order() -> None:
    disk, trace, told = followed()
    record(trace, 1.0)
    disk.full = True
    for at_s in (2.0, 3.0):
        with pytest.raises(Kept, match="make room"):
            record(trace, at_s)
    with pytest.raises(Kept):
        trace.sync()
    assert (told, disk.stored, trace.missing) == ([1.0, 2.0, 3.0], [1.0], 2)
    disk.full = False
    record(trace, 4.0)
    assert (told, disk.stored, trace.missing) == ([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, 4.0], 0)


def test_a_sync_stores_what_waits() -> None:
    disk, trace, _ = followed()
    disk.full = True
    with pytest.raises(Kept):
        record(trace, 1.0)
    disk.full = False
    trace.sync()
    assert disk.stored == [1.0] and trace.missing == 0


def test_more_than_may_wait_is_told_and_counted_as_missing_for_good() -> None:
    disk, trace, told = followed(most=2)
    disk.full = True
    for at_s in (1.0, 2.0):
        with pytest.raises(Kept):
            record(trace, at_s)
    with pytest.raises(ValueError, match="2 events wait for room; one more is lost: make room"):
        record(trace, 3.0)
    disk.full = False
    record(trace, 4.0)
    assert told == [1.0, 2.0, 3.0, 4.0] and trace.missing == 1 and 3.0 not in disk.stored


def test_what_the_journal_cannot_take_is_raised_and_does_not_wait() -> None:
    disk, trace, _ = followed()
    with pytest.raises(ValueError, match="must be finite"):
        record(trace, float("nan"))
    record(trace, 2.0)
    assert disk.stored == [2.0] and trace.missing == 0


def test_what_the_journal_cannot_take_later_is_told_as_a_trouble() -> None:
    disk, trace, _ = followed()
    disk.full = True
    with pytest.raises(Kept):
        record(trace, float("nan"))
    disk.full = False
    record(trace, 2.0)
    assert disk.stored == [2.0]
    assert "event 'measured', nan s, is not stored" in trace.take_troubles()[0]


def test_a_follower_may_record() -> None:
    disk, trace, told = followed()
    trace.subscribe(lambda event, at_s: record(trace, 9.0) if at_s == 1.0 else None)
    record(trace, 1.0)
    assert told == [1.0, 9.0] == disk.stored
