"""A segment of the log: written by one process, read by any."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from homeostat.history.embedded.layout import sync
from homeostat.history.embedded.records import (
    HEADER,
    Gap,
    Kept,
    Kind,
    Record,
    names_of,
    names_record,
    occurrence_of,
    occurrence_record,
    samples_of,
    samples_record,
    scan,
)
from homeostat.history.samples import LONGEST_NAME, Batch, Codes, Times, Values
from homeostat.history.store import Occurrence

ARRIVAL_BITS = 32
"""Bits of an arrival's number that count within its segment; those above are the segment's number."""


@final
class SegmentWriter:
    """Appends records to a new file, each with one system call; a write that fails leaves nothing."""

    def __init__(self, path: Path) -> None:
        """Begin the segment; OSError where the file is there or cannot be made."""
        self.path = path
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        self._size, self._numbers = 0, dict[str, int]()
        self._named = False
        self.samples = 0
        """Samples in it."""
        self.occurrences = 0
        """Alarms and events in it."""

    @property
    def empty(self) -> bool:
        """Whether nothing was appended."""
        return not (self.samples or self.occurrences)

    def append(self, batch: Batch) -> None:
        """Add a batch; ValueError for a tag whose name is none, OSError where there is no room: nothing is added."""
        fresh = dict.fromkeys(tag for tag in batch.tags if tag not in self._numbers)
        for tag in fresh:
            _refuse_no_name(tag)
        numbers = {tag: len(self._numbers) + k for k, tag in enumerate(fresh)}
        every = self._numbers | numbers if numbers else self._numbers
        record = samples_record(batch, [every[tag] for tag in batch.tags])
        self._write((names_record(numbers) if numbers else b"") + record)
        self._numbers = every
        self.samples += len(batch.tags)

    def record(self, occurrence: Occurrence) -> None:
        """Add an alarm or an event; OSError where there is no room, and nothing is added."""
        self._write(occurrence_record(occurrence))
        self.occurrences += 1

    def sync(self) -> None:
        """Return when all of it is safe from a power cut."""
        os.fdatasync(self._file)
        if not self._named:  # nor may the file's name be lost
            sync(self.path.parent)
            self._named = True

    def close(self) -> None:
        """Nothing more is added."""
        os.close(self._file)

    def _write(self, content: bytes) -> None:
        if self._size == 0:
            content = HEADER + content
        written = 0
        try:
            written = os.write(self._file, content)
            if written != len(content):
                written = self._rest(content, written)
        finally:
            if written != len(content):
                os.ftruncate(self._file, self._size)
        self._size += written

    def _rest(self, content: bytes, written: int) -> int:
        """Write what did not go out at once: a disk that is nearly full takes a part, and says so at the next try."""
        while written < len(content):
            written += os.write(self._file, content[written:])
        return written


def _refuse_no_name(tag: str) -> None:
    if not tag or len(tag) > LONGEST_NAME or not tag.isprintable():
        text = f"{tag!r:.80} is no name of a tag"
        raise ValueError(f"{text}; it needs 1 to {LONGEST_NAME} visible characters")


@dataclass(frozen=True, slots=True)
class Content:
    """What a segment holds; n samples in the order in which they arrived, m arrivals."""

    names: tuple[str, ...]
    """Tag of each number."""
    tag: Times
    """Number of each sample's tag, shape (n,)."""
    time_us: Times
    """Source time [us], shape (n,)."""
    value: Values
    """Value, shape (n,)."""
    quality: Codes
    """Status code, shape (n,)."""
    arrival: Times
    """Number of each sample's arrival, in this segment, shape (n,)."""
    server_us: Times
    """Server time of each arrival [us], shape (m,)."""
    own_us: Times
    """Own time of each arrival [us], shape (m,)."""
    occurrences: tuple[Occurrence, ...]
    """Alarms and events, as they were recorded."""
    gaps: tuple[Gap, ...]
    """Bytes that are no record."""
    lost: int
    """Samples of tags whose names were in a gap."""


def read_segment(path: Path) -> Content:
    """Everything whole in a segment, which may be written to at this moment; OSError where it cannot be read."""
    return content_of(path.read_bytes())


def content_of(raw: bytes) -> Content:
    """Everything whole in the bytes of a segment."""
    names, kept, occurrences, gaps = dict[int, str](), list[Kept](), list[Occurrence](), list[Gap]()
    for found in scan(raw):
        match found:
            case Gap():
                gaps.append(found)
            case Record(kind=Kind.TAGS):
                names |= {number: name for name, number in names_of(found).items()}
            case Record(kind=Kind.SAMPLES):
                kept.append(samples_of(found))
            case Record(kind=Kind.OCCURRENCE):
                occurrences.append(occurrence_of(found))
    return _content(names, kept, occurrences, gaps)


def _content(names: dict[int, str], kept: list[Kept], occurrences: list[Occurrence], gaps: list[Gap]) -> Content:
    arrivals, first = list[Times](), 0
    for batch in kept:
        arrivals.append(batch.arrival + first)
        first += len(batch.server_us)
    own = [np.full(len(batch.server_us), batch.own_us, dtype=np.int64) for batch in kept]
    tag = _joined([batch.tag for batch in kept], "i8")
    known = np.isin(tag, list(names)) if gaps else np.ones(len(tag), dtype=bool)
    return Content(
        names=tuple(names.get(number, "") for number in range(max(names, default=-1) + 1)),
        tag=tag[known],
        time_us=_joined([batch.time_us for batch in kept], "i8")[known],
        value=_joined([batch.value for batch in kept], "f8")[known],
        quality=_joined([batch.quality for batch in kept], "u4")[known],
        arrival=_joined(arrivals, "i8")[known],
        server_us=_joined([batch.server_us for batch in kept], "i8"),
        own_us=_joined(own, "i8"),
        occurrences=tuple(occurrences),
        gaps=tuple(gaps),
        lost=int(len(tag) - known.sum()),
    )


def _joined(parts: Sequence[NDArray[Any]], kind: str) -> NDArray[Any]:
    return np.concatenate(parts) if parts else np.empty(0, dtype=kind)
