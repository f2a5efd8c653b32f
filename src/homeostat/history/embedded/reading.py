"""The reading side of a store in a folder: the log as far as it goes, and the tables behind it."""

import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final, NamedTuple, TypeVar, final

import numpy as np

from homeostat.history.embedded.layout import (
    ARRIVALS,
    EVENTS,
    MINUTES,
    RAW,
    SegmentFile,
    TableFile,
    listed,
    refuse_other,
    segments_of,
)
from homeostat.history.embedded.names import read_names
from homeostat.history.embedded.sealing import by_tag, minutes_of, read_occurrences
from homeostat.history.embedded.segment import Content, content_of
from homeostat.history.embedded.tables import (
    ARRIVALS_SCHEMA,
    MINUTES_SCHEMA,
    RAW_SCHEMA,
    Columns,
    SortedTable,
    TagRows,
    read_plain,
)
from homeostat.history.minutes import combine, roll_up
from homeostat.history.samples import NO_SAMPLES, NO_TIME, Minutes, Series, Span, Times
from homeostat.history.store import HistoryError, Occurrence, UnknownTag
from homeostat.stl.spelling import near_matches

T = TypeVar("T")

_TRIES: Final = 10
"""Attempts to read while files are being joined or dropped."""
_PAUSE_S: Final = 0.01
"""How much longer each of them waits than the one before [s]."""
_OPEN: Final = 64
"""Tables whose footers are kept in memory."""
_RAW_COLUMNS: Final = tuple(RAW_SCHEMA.names[1:])
_MINUTE_COLUMNS: Final = tuple(MINUTES_SCHEMA.names[1:])
_NO_TIMES: Final = np.empty(0, dtype=np.int64)


class _Part(NamedTuple):
    """Samples of one tag out of one file."""

    columns: Columns
    arrivals: Columns


@final
class EmbeddedHistory:
    """Implements :class:`homeostat.history.store.HistoryReader`; whoever writes meanwhile is not disturbed."""

    def __init__(self, folder: Path | str) -> None:
        """Look into ``folder``; HistoryError where it is no store."""
        self._folder = Path(folder)
        refuse_other(self._folder)
        self._reading = threading.Lock()
        self._open: OrderedDict[Path, SortedTable] = OrderedDict()
        self._arrivals: OrderedDict[Path, Columns] = OrderedDict()
        self._segments: dict[Path, tuple[int, Content]] = {}

    def tags(self) -> tuple[str, ...]:
        """Names of all tags."""
        return self._steadily(self._tags)

    def extent(self) -> Span | None:
        """From the earliest source time to just after the latest one."""
        return self._steadily(self._extent)

    def read(self, tags: Sequence[str], span: Span) -> Mapping[str, Series]:
        """Tag -> its samples inside ``span``."""
        found = self._steadily(lambda: self._read(tags, span))
        self._refuse_unknown([tag for tag, series in found.items() if not series.length])
        return found

    def minutes(self, tags: Sequence[str], span: Span) -> Mapping[str, Minutes]:
        """Tag -> its minutes inside ``span``."""
        found = self._steadily(lambda: self._minutes(tags, span))
        self._refuse_unknown([tag for tag, minutes in found.items() if not minutes.length])
        return found

    def last(self, tags: Sequence[str]) -> Mapping[str, Series]:
        """Tag -> its sample with the latest source time."""
        found = self._steadily(lambda: self._last(tags))
        self._refuse_unknown([tag for tag, series in found.items() if not series.length])
        return found

    def occurrences(self, span: Span) -> tuple[Occurrence, ...]:
        """Alarms and events inside ``span``."""
        return self._steadily(lambda: self._occurrences(span))

    def _steadily(self, work: Callable[[], T]) -> T:
        """What ``work`` returns; once more where a file has gone while it was reading."""
        for k in range(_TRIES):
            if k:
                time.sleep(k * _PAUSE_S)
            try:
                with self._reading:
                    return work()
            except FileNotFoundError:
                refuse_other(self._folder)
        raise HistoryError(f"files of {str(self._folder)!r} go while they are read; is anybody else removing them?")

    def _tags(self) -> tuple[str, ...]:
        # The log first: what becomes a table meanwhile has its names among those that are read then.
        contents = self._contents(segments_of(self._folder))
        names = set(read_names(self._folder))
        return tuple(sorted(names.union(*(filter(None, content.names) for _, content in contents))))

    def _extent(self) -> Span | None:
        files = listed(self._folder, RAW)
        ends = [(table.from_us, table.to_us) for table in files.tables]
        for _, content in self._contents(files.segments):
            if len(content.time_us):
                ends.append((int(content.time_us.min()), int(content.time_us.max())))
        return Span(min(e[0] for e in ends), max(e[1] for e in ends) + 1) if ends else None

    def _refuse_unknown(self, tags: Sequence[str]) -> None:
        if tags:
            known = self.tags()
            for tag in tags:
                if tag not in known:
                    text = f"the history in {str(self._folder)!r} has no tag {tag!r}{near_matches(tag, known)}"
                    raise UnknownTag(f"{text}; it has {len(known)} tags")

    def _read(self, tags: Sequence[str], span: Span) -> Mapping[str, Series]:
        found: dict[str, list[_Part]] = {tag: [] for tag in tags}
        files = listed(self._folder, RAW)
        contents = self._contents(files.segments)
        arrivals = listed(self._folder, ARRIVALS).tables
        for table in files.tables:
            if table.overlaps(span):
                self._add_parts(found, table, span, arrivals)
        for _, content in contents:
            for rows in by_tag(content):
                if rows.tag in found:
                    found[rows.tag].append(_of_segment(content, rows))
        return {tag: _series(parts).within(span) for tag, parts in found.items()}

    def _add_parts(
        self, found: Mapping[str, list[_Part]], table: TableFile, span: Span, every: Sequence[TableFile]
    ) -> None:
        """The samples of a table inside ``span``; ``every``: the tables of arrivals."""
        inside = list[tuple[str, Columns]]()
        for tag, columns in self._table(table).read(found, _RAW_COLUMNS):
            first, end = np.searchsorted(columns["time"], [span.from_us, span.to_us])
            if end > first:
                inside.append((tag, {name: column[first:end] for name, column in columns.items()}))
        if inside:
            arrivals = self._arrivals_of(table, every)
            for tag, columns in inside:
                found[tag].append(_Part(columns, arrivals))

    def _minutes(self, tags: Sequence[str], span: Span) -> Mapping[str, Minutes]:
        found: dict[str, list[Minutes]] = {tag: [] for tag in tags}
        files = listed(self._folder, MINUTES)
        contents = self._contents(files.segments)
        for table in files.tables:
            if table.overlaps(span):
                for tag, columns in self._table(table).read(tags, _MINUTE_COLUMNS):
                    found[tag].append(minutes_of(columns))
        for _, content in contents:
            for rows in by_tag(content):
                if rows.tag in found:
                    columns = rows.columns
                    found[rows.tag].append(roll_up(columns["time"], columns["value"], columns["quality"]))
        return {tag: combine(parts).within(span) for tag, parts in found.items()}

    def _last(self, tags: Sequence[str]) -> Mapping[str, Series]:
        files = listed(self._folder, RAW)
        contents, arrivals = self._contents(files.segments), listed(self._folder, ARRIVALS).tables
        found: dict[str, list[tuple[int, Series]]] = {tag: [] for tag in tags}
        for segment, content in contents:
            for rows in by_tag(content):
                if rows.tag in found:
                    found[rows.tag].append((segment.number, _series([_of_segment(content, rows)]).tail(1)))
        for table in sorted(files.tables, key=lambda t: t.to_us, reverse=True):
            # A later sample than any that this table and those after it have is the last one.
            open_ = [t for t, known in found.items() if all(s.time_us[0] <= table.to_us for _, s in known)]
            parts: dict[str, list[_Part]] = {tag: [] for tag in open_}
            self._add_parts(parts, table, Span(table.from_us, table.to_us + 1), arrivals)
            for tag, of_tag in parts.items():
                if of_tag:
                    found[tag].append((table.first, _series(of_tag).tail(1)))
        return {tag: _latest(known) for tag, known in found.items()}

    def _occurrences(self, span: Span) -> tuple[Occurrence, ...]:
        files = listed(self._folder, EVENTS)
        every = [o for _, content in self._contents(files.segments) for o in content.occurrences]
        every = [o for table in files.tables if table.overlaps(span) for o in read_occurrences(table.path)] + every
        inside = (o for o in every if span.from_us <= o.time_us < span.to_us)
        return tuple(sorted(inside, key=lambda o: o.time_us))

    def _table(self, table: TableFile) -> SortedTable:
        path = table.path
        if path not in self._open:
            self._open[path] = SortedTable(path)
            while len(self._open) > _OPEN:
                self._open.popitem(last=False)
        self._open.move_to_end(path)
        return self._open[path]

    def _arrivals_of(self, table: TableFile, every: Sequence[TableFile]) -> Columns:
        """Every arrival of the segments of a table, by number."""
        parts = list[Columns]()
        for other in every:
            if other.first <= table.last and other.last >= table.first:
                if other.path not in self._arrivals:
                    self._arrivals[other.path] = read_plain(other.path, ARRIVALS_SCHEMA.names)
                    while len(self._arrivals) > _OPEN:
                        self._arrivals.popitem(last=False)
                parts.append(self._arrivals[other.path])
        if len(parts) == 1:
            return parts[0]
        return {n: np.concatenate([_NO_TIMES, *(part[n] for part in parts)]) for n in ARRIVALS_SCHEMA.names}

    def _contents(self, segments: Iterable[SegmentFile]) -> list[tuple[SegmentFile, Content]]:
        """What the segments hold now; one is read again only where it has grown."""
        with ExitStack() as stack:
            # All are opened before one is read: meanwhile they may become tables and go.
            files = [(segment, stack.enter_context(segment.path.open("rb"))) for segment in segments]
            known, found = self._segments, list[tuple[SegmentFile, Content]]()
            self._segments = {}
            for segment, file in files:
                size = os.fstat(file.fileno()).st_size
                before = known.get(segment.path)
                content = before[1] if before and before[0] == size else content_of(file.read(size))
                self._segments[segment.path] = size, content
                found.append((segment, content))
        return found


def _of_segment(content: Content, rows: TagRows) -> _Part:
    arrival = np.arange(len(content.own_us), dtype=np.int64)
    return _Part(rows.columns, {"arrival": arrival, "server_time": content.server_us, "own_time": content.own_us})


def _series(parts: Sequence[_Part]) -> Series:
    """Samples out of several files, in the order in which they arrived, by time."""
    if not parts:
        return NO_SAMPLES
    server, own = zip(*(_arrived(part) for part in parts), strict=True)
    columns = {n: np.concatenate([p.columns[n] for p in parts]) for n in ("time", "value", "quality")}
    order = np.argsort(columns["time"], kind="stable")
    every = (columns["time"], columns["value"], columns["quality"], np.concatenate(server), np.concatenate(own))
    return Series(*(column[order] for column in every))


def _arrived(part: _Part) -> tuple[Times, Times]:
    """Server and own time of each sample; NO_TIME where the table of arrivals has gone."""
    known, wanted = part.arrivals["arrival"], part.columns["arrival"]
    if not len(known):
        none = np.full(len(wanted), NO_TIME, dtype=np.int64)
        return none, none
    at = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
    there = known[at] == wanted
    server, own = (np.where(there, part.arrivals[name][at], NO_TIME) for name in ("server_time", "own_time"))
    return server, own


def _latest(known: Sequence[tuple[int, Series]]) -> Series:
    """The sample with the latest time, of equal ones that which arrived last; each with the number of its file."""
    return max(known, key=lambda k: (int(k[1].time_us[0]), k[0]))[1] if known else NO_SAMPLES
