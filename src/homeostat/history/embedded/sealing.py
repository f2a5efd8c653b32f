"""From a segment of the log to tables, and from several tables to one: sorted, rolled up and small."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields
from itertools import groupby
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.history.embedded.layout import (
    ARRIVALS,
    EVENTS,
    MINUTES,
    RAW,
    SegmentFile,
    TableFile,
    listed,
    segments_of,
)
from homeostat.history.embedded.segment import ARRIVAL_BITS, Content
from homeostat.history.embedded.tables import (
    ARRIVALS_SCHEMA,
    EVENTS_SCHEMA,
    MINUTES_SCHEMA,
    RAW_SCHEMA,
    Columns,
    SortedTable,
    TagRows,
    plain_table,
    read_plain,
    write_plain,
    write_sorted,
)
from homeostat.history.minutes import combine, roll_up
from homeostat.history.samples import Minutes
from homeostat.history.store import HistoryError, Occurrence

Merge: TypeAlias = Callable[[Path, list[Path]], None]
"""Writes a table from those of smaller ones."""

HOUR, DAY = 13, 10
"""Characters of a label that name an hour, and a day."""
AT_ONCE: Final = 64
"""Most tables that are joined at once: each of them is an open file."""
_MINUTE_COLUMNS: Final = dict(zip((f.name for f in fields(Minutes)), MINUTES_SCHEMA.names[1:], strict=True))


def seal(store: Path, segment: SegmentFile, content: Content) -> None:
    """Write the tables of a segment; done again after a death, it writes the same. OSError where there is no room."""
    rows = list(by_tag(content))
    if rows:
        arrival = np.arange(len(content.own_us), dtype=np.int64) + (segment.number << ARRIVAL_BITS)
        span = int(content.time_us.min()), int(content.time_us.max())
        columns = {"arrival": arrival, "server_time": content.server_us, "own_time": content.own_us}
        write_plain(_table_of(store, ARRIVALS, segment, span).path, plain_table(ARRIVALS_SCHEMA, columns))
        write_sorted(_table_of(store, MINUTES, segment, span).path, MINUTES_SCHEMA, map(_rolled_up, rows))
    if content.occurrences:
        write_occurrences(_table_of(store, EVENTS, segment, _span(content.occurrences)).path, content.occurrences)
    if rows:  # last: a segment without a table of samples is sealed again
        write_sorted(_table_of(store, RAW, segment, span).path, RAW_SCHEMA, _numbered(rows, segment))


def by_tag(content: Content) -> Iterator[TagRows]:
    """The samples of each tag of a segment, by name, in order of their time; arrivals count from 0."""
    ranked = sorted(range(len(content.names)), key=lambda k: content.names[k])
    rank = np.empty(len(ranked), dtype=np.int64)
    rank[ranked] = np.arange(len(ranked))
    place = rank[content.tag]
    order = np.argsort(place.astype(np.uint16) if len(ranked) < 1 << 16 else place, kind="stable")
    ends = np.cumsum(np.bincount(place, minlength=len(ranked)))
    first = 0
    for k, end in zip(ranked, ends.tolist(), strict=True):
        if end > first:
            yield TagRows(content.names[k], _in_time(content, order[first:end]))
        first = end


def compact(store: Path, current: str) -> None:
    """Join the tables of each hour that is over, and small ones of each day; ``current``: label of this hour.

    Raises HistoryError where tables cannot be joined because one is damaged, after all others were.
    """
    damaged = list[str]()
    damaged += _compact(store, ARRIVALS, _merge_arrivals, HOUR, current)
    damaged += _compact(store, RAW, _merge_raw, HOUR, current)
    damaged += _compact(store, MINUTES, _merge_minutes, DAY, current)
    damaged += _compact(store, EVENTS, _merge_occurrences, DAY, current)
    if damaged:
        raise HistoryError("; ".join(damaged))


def write_occurrences(path: Path, occurrences: Iterable[Occurrence]) -> None:
    """The table of alarms and events, by time."""
    rows = sorted(occurrences, key=lambda o: o.time_us)
    columns: dict[str, Any] = {
        "time": np.array([o.time_us for o in rows], dtype=np.int64),
        "own_time": np.array([o.own_us for o in rows], dtype=np.int64),
        "severity": np.array([o.severity for o in rows], dtype=np.int32),
    }
    for name in ("kind", "source", "text", "details"):
        columns[name] = [_storable(getattr(o, name)) for o in rows]
    write_plain(path, plain_table(EVENTS_SCHEMA, columns))


def _storable(text: str) -> str:
    """``text``, with an escape for half a character, as a file's name may have: a table takes whole ones only."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def read_occurrences(path: Path) -> list[Occurrence]:
    """What :func:`write_occurrences` wrote."""
    columns = read_plain(path, EVENTS_SCHEMA.names)
    names = {"time": "time_us", "own_time": "own_us"}
    made = {names.get(name, name): column.tolist() for name, column in columns.items()}
    return [Occurrence(**dict(zip(made, row, strict=True))) for row in zip(*made.values(), strict=True)]


def minutes_of(columns: Columns) -> Minutes:
    """Rows of the roll-up as the table has them."""
    return Minutes(*(columns[name] for name in _MINUTE_COLUMNS.values()))


def _table_of(store: Path, kind: str, segment: SegmentFile, span: tuple[int, int]) -> TableFile:
    return TableFile(segment.number, segment.number, segment.label, *span, store / kind)


def _span(occurrences: Sequence[Occurrence]) -> tuple[int, int]:
    return min(o.time_us for o in occurrences), max(o.time_us for o in occurrences)


def _in_time(content: Content, chosen: NDArray[np.intp]) -> Columns:
    """The chosen samples, which are in order of their arrival, in order of their time."""
    time = content.time_us[chosen]
    if (time[1:] < time[:-1]).any():
        chosen = chosen[np.argsort(time, kind="stable")]
    return {
        "time": content.time_us[chosen],
        "value": content.value[chosen],
        "quality": content.quality[chosen],
        "arrival": content.arrival[chosen],
    }


def _numbered(rows: Iterable[TagRows], segment: SegmentFile) -> Iterator[TagRows]:
    first = segment.number << ARRIVAL_BITS
    for one in rows:
        yield TagRows(one.tag, {**one.columns, "arrival": one.columns["arrival"] + first})


def _rolled_up(rows: TagRows) -> TagRows:
    made = roll_up(rows.columns["time"], rows.columns["value"], rows.columns["quality"])
    return _minute_rows(rows.tag, made)


def _minute_rows(tag: str, minutes: Minutes) -> TagRows:
    return TagRows(tag, {column: getattr(minutes, name) for name, column in _MINUTE_COLUMNS.items()})


def _compact(store: Path, kind: str, merge: Merge, length: int, current: str) -> Iterator[str]:
    """Join the tables of one hour, or one day, that follow one another, but for those of the ``current`` hour.

    Says which could not be joined, and why.
    """
    tables = listed(store, kind).tables
    for (label, still), group in groupby(tables, key=lambda t: (t.label[:length], t.label[:HOUR] == current)):
        same = list(group)
        try:
            while not still and len(same) > 1:
                bites = [same[k : k + AT_ONCE] for k in range(0, len(same), AT_ONCE)]
                joined = [_join(store / kind, bite, label, merge) for bite in bites]
                same = [] if None in joined else [table for table in joined if table is not None]
        except HistoryError as damaged:
            yield str(damaged)


def _join(folder: Path, same: Sequence[TableFile], label: str, merge: Merge) -> TableFile | None:
    """One table of those that are the ``same`` hour or day; None where it must wait."""
    if len(same) == 1:
        return same[0]
    first, last = same[0].first, same[-1].last
    # What is not sealed yet must not seem to be in a table that spans its number.
    if any(first <= s.number <= last for s in segments_of(folder.parent)):
        return None
    span = min(t.from_us for t in same), max(t.to_us for t in same)
    joined = TableFile(first, last, label, *span, folder)
    merge(joined.path, [t.path for t in same])
    for table in same:
        table.path.unlink(missing_ok=True)
    return joined


def _merge_raw(path: Path, sources: list[Path]) -> None:
    write_sorted(path, RAW_SCHEMA, _merged(sources, RAW_SCHEMA.names[1:], _joined))


def _merge_minutes(path: Path, sources: list[Path]) -> None:
    write_sorted(path, MINUTES_SCHEMA, _merged(sources, MINUTES_SCHEMA.names[1:], _combined))


def _merge_arrivals(path: Path, sources: list[Path]) -> None:
    parts = [read_plain(source, ARRIVALS_SCHEMA.names) for source in sources]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in ARRIVALS_SCHEMA.names}
    write_plain(path, plain_table(ARRIVALS_SCHEMA, columns))


def _merge_occurrences(path: Path, sources: list[Path]) -> None:
    write_occurrences(path, [o for source in sources for o in read_occurrences(source)])


def _merged(
    sources: Sequence[Path], columns: Sequence[str], join: Callable[[str, list[Columns]], TagRows]
) -> Iterator[TagRows]:
    """The rows of each tag of all sources, a tag at a time."""
    tables = [SortedTable(source) for source in sources]
    every = sorted({tag for table in tables for tag in table.tags})
    readers = [table.read(table.tags, columns) for table in tables]
    heads = [next(reader, None) for reader in readers]
    for tag in every:
        parts = list[Columns]()
        for k, head in enumerate(heads):
            if head is not None and head[0] == tag:
                parts.append(head[1])
                heads[k] = next(readers[k], None)
        yield join(tag, parts)


def _joined(tag: str, parts: list[Columns]) -> TagRows:
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    time = columns["time"]
    if (time[1:] < time[:-1]).any():
        order = np.argsort(time, kind="stable")
        columns = {name: column[order] for name, column in columns.items()}
    return TagRows(tag, columns)


def _combined(tag: str, parts: list[Columns]) -> TagRows:
    return _minute_rows(tag, combine([minutes_of(part) for part in parts]))
