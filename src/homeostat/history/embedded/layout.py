"""The folder of a store: which files it has, what their names say, and which of them count.

A segment is a piece of the log with a number; a table holds one or more segments, and its name says which, and what
source times it spans: ``2026-11-25T13.00000041-00000052.1764075600000000_1764079199000000.parquet``. Where two
tables hold the same segment, the larger one counts: it was made from the smaller ones, which are about to be removed.
"""

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from homeostat.history.samples import Span
from homeostat.history.store import HistoryError

LOG: Final = "log"
"""Folder of the write-ahead log."""
RAW: Final = "raw"
"""Folder of the samples."""
ARRIVALS: Final = "arrivals"
"""Folder of the times at which samples arrived."""
MINUTES: Final = "minutes"
"""Folder of the roll-up."""
EVENTS: Final = "events"
"""Folder of alarms and events."""
KINDS: Final = (RAW, ARRIVALS, MINUTES, EVENTS)
"""Folders of tables."""
MARK: Final = "homeostat-history"
"""File that says that a folder is a store, and in which format."""
FORMAT: Final = "1\n"
"""What it says."""
PARTIAL: Final = ".partial"
"""Ending of a file that is being written."""

_TABLE: Final = re.compile(r"(\d{4,}-\d\d-\d\d(?:T\d\d)?)\.(\d{8,})-(\d{8,})\.(-?\d+)_(-?\d+)\.parquet")
_SEGMENT: Final = re.compile(r"(\d{8,})\.(\d{4,}-\d\d-\d\dT\d\d)\.log")
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_TRIES: Final = 20
"""Listings of a folder until two are alike; files come and go at most every few minutes."""


@dataclass(frozen=True, slots=True, order=True)
class TableFile:
    """A table as its name tells it."""

    first: int
    """Number of the first segment in it."""
    last: int
    """Number of the last one."""
    label: str
    """Day or hour of our own clock: ``2026-11-25``, ``2026-11-25T13``."""
    from_us: int
    """Earliest source time [us]."""
    to_us: int
    """Latest one [us]."""
    folder: Path
    """Where it is."""

    @property
    def path(self) -> Path:
        """The file."""
        span = f"{self.from_us}_{self.to_us}"
        return self.folder / f"{self.label}.{self.first:08d}-{self.last:08d}.{span}.parquet"

    def overlaps(self, span: Span) -> bool:
        """Whether it may have anything inside ``span``."""
        return span.overlaps(self.from_us, self.to_us)

    def holds(self, other: "TableFile | SegmentFile") -> bool:
        """Whether every segment of ``other`` is in this one."""
        first, last = (other.first, other.last) if isinstance(other, TableFile) else (other.number, other.number)
        return self.first <= first and last <= self.last


@dataclass(frozen=True, slots=True, order=True)
class SegmentFile:
    """A segment of the log as its name tells it."""

    number: int
    """The higher, the later."""
    label: str
    """Hour of our own clock in which it began."""
    folder: Path
    """Where it is."""

    @property
    def path(self) -> Path:
        """The file."""
        return self.folder / f"{self.number:08d}.{self.label}.log"


@dataclass(frozen=True, slots=True)
class Files:
    """What a store consisted of at one moment; no sample is in two of its files."""

    tables: tuple[TableFile, ...]
    """Tables of one kind, by their segments."""
    segments: tuple[SegmentFile, ...]
    """Segments that are in none of them."""


def refuse_other(folder: Path) -> None:
    """HistoryError where ``folder`` is no store, or one of another format."""
    try:
        said = (folder / MARK).read_text("ascii", "replace")
    except (FileNotFoundError, NotADirectoryError):
        text = f"{str(folder)!r} is no history; 'homeostat run CASE --history DIR' makes one"
        raise HistoryError(text) from None
    if said != FORMAT:
        read = f"this version reads {FORMAT.strip()}"
        raise HistoryError(f"{str(folder)!r} is a history of format {said.strip()!r:.20}; {read}")


def hour_label(at_us: int) -> str:
    """The hour of a time [us], as names have it; the first or last one of the calendar for times outside it."""
    hours = min(max(at_us // 3_600_000_000, -17_259_888), 70_389_527)  # years 1 to 9999
    return (_EPOCH + timedelta(hours=hours)).strftime("%Y-%m-%dT%H").zfill(13)


def sync(path: Path) -> None:
    """Return when a file, or the names in a folder, are safe from a power cut."""
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def listed(store: Path, kind: str) -> Files:
    """The files of one ``kind`` that count now, and the segments of the log that are in none of them."""
    segments = _segments(store)  # first: what is moved meanwhile is then found in a table
    every = tuple(_tables(store / kind))
    counting = _counting(every)
    return Files(counting, tuple(s for s in segments if not any(t.holds(s) for t in counting)))


def replaced(store: Path, kind: str) -> list[TableFile]:
    """Tables of which a larger one has everything."""
    every = tuple(_tables(store / kind))
    return sorted(set(every) - set(_counting(every)))


def segments_of(store: Path) -> list[SegmentFile]:
    """Every segment of the log, the oldest first."""
    return _segments(store)


def _counting(tables: Iterable[TableFile]) -> tuple[TableFile, ...]:
    """Those that no other one holds, by their segments."""
    found: list[TableFile] = []
    for table in sorted(tables, key=lambda t: (t.first, -t.last, t.label, t.from_us, t.to_us)):
        if not found or not found[-1].holds(table):
            found.append(table)
    return tuple(found)


def _segments(store: Path) -> list[SegmentFile]:
    matches = ((_SEGMENT.fullmatch(name), store / LOG) for name in _names(store / LOG))
    return sorted(SegmentFile(int(m[1]), m[2], folder) for m, folder in matches if m)


def _tables(folder: Path) -> Iterator[TableFile]:
    for name in _names(folder):
        if m := _TABLE.fullmatch(name):
            yield TableFile(int(m[2]), int(m[3]), m[1], int(m[4]), int(m[5]), folder)


def _names(folder: Path) -> list[str]:
    """Names in ``folder``, as they all were at one moment: a folder that changes is listed once more."""
    before: list[str] | None = None
    for _ in range(_TRIES):
        try:
            names = sorted(os.listdir(folder))
        except FileNotFoundError:
            names = []
        if names == before:
            return names
        before = names
    raise HistoryError(f"{str(folder)!r} changes each time it is listed; is something else writing there?")
