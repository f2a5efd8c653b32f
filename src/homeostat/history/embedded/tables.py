"""Tables of a store: Parquet files, sorted by tag and then by time, which any reader of Parquet can use.

The footer says in which rows each tag is, so that a few tags are read without looking at the others.
"""

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias, final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from homeostat.history.embedded.layout import PARTIAL, sync
from homeostat.history.samples import NO_TIME
from homeostat.history.store import HistoryError

Columns: TypeAlias = Mapping[str, NDArray[Any]]
"""Name of a column -> its values, shape (n,), n the same for all."""

_TIME: Final = pa.timestamp("us", "UTC")


def _schema(*fields: tuple[str, pa.DataType], nullable: Sequence[str] = ()) -> pa.Schema:
    return pa.schema([pa.field(name, kind, nullable=name in nullable) for name, kind in fields])


RAW_SCHEMA: Final = _schema(
    ("tag", pa.string()), ("time", _TIME), ("value", pa.float64()), ("quality", pa.uint32()), ("arrival", pa.int64())
)
"""Samples; ``arrival`` is the key of the table of arrivals."""
ARRIVALS_SCHEMA: Final = _schema(
    ("arrival", pa.int64()), ("server_time", _TIME), ("own_time", _TIME), nullable=["server_time"]
)
"""When samples were with the server, and with us: a few rows for each batch."""
MINUTES_SCHEMA: Final = _schema(
    ("tag", pa.string()),
    ("minute", _TIME),
    ("minimum", pa.float64()),
    ("maximum", pa.float64()),
    ("mean", pa.float64()),
    ("last", pa.float64()),
    ("last_time", _TIME),
    ("good", pa.int64()),
    ("count", pa.int64()),
    nullable=["last_time"],
)
"""The roll-up."""
EVENTS_SCHEMA: Final = _schema(
    ("time", _TIME),
    ("own_time", _TIME),
    ("kind", pa.string()),
    ("source", pa.string()),
    ("severity", pa.int32()),
    ("text", pa.string()),
    ("details", pa.string()),
)
"""Alarms and events."""

_ROWS: Final = 32_768
"""Rows after which a row group ends, where the next tag begins: a trend reads a row group per tag and hour."""
_FEWER_ROWS: Final = 4096
"""The same for the roll-up, which has fewer rows per tag and more columns."""
_MOST_ROWS: Final = 1 << 20
"""Rows of a row group with one tag."""
_LEVEL: Final = 3
"""Level of the compression (zstd): from 1 to 3 a tenth less, beyond that a hundredth less for twice the time."""
_VALUE_ENCODINGS: Final = ("dictionary", "BYTE_STREAM_SPLIT", "PLAIN")
"""What is tried on the first row groups of a file: which one is the smallest depends on the instruments."""
_INDEX: Final = b"homeostat.tags"


@dataclass(frozen=True, slots=True)
class TagRows:
    """The rows of one tag, to be written to a table."""

    tag: str
    """Its name."""
    columns: Columns
    """All other columns of the table."""


def write_sorted(path: Path, schema: pa.Schema, rows: Iterable[TagRows]) -> None:
    """Write a table whose first column is the tag; ``rows`` come in the order of the tags' names.

    Others see the file not at all or whole, even after a power cut. Raises OSError where there is no room.
    """
    index = dict[str, int]()
    with _Whole(path) as whole:
        writer: pq.ParquetWriter | None = None
        for group in _groups(rows, _ROWS if schema is RAW_SCHEMA else _FEWER_ROWS):
            table = _table(schema, group)
            for one in group:
                index[one.tag] = len(next(iter(one.columns.values())))
            if writer is None:
                writer = _writer(whole.partial, schema, table)
            writer.write_table(table, row_group_size=_MOST_ROWS)
        if writer is None:
            writer = _writer(whole.partial, schema, schema.empty_table())
        writer.add_key_value_metadata({_INDEX.decode(): json.dumps(index)})
        writer.close()


def write_plain(path: Path, table: pa.Table) -> None:
    """Write a table that has no tags, as :func:`write_sorted` does."""
    with _Whole(path) as whole:
        writer = _writer(whole.partial, table.schema, table)
        writer.write_table(table)
        writer.close()


@final
class SortedTable:
    """A table that was written by :func:`write_sorted`, opened once."""

    def __init__(self, path: Path) -> None:
        """Read the footer; FileNotFoundError where it has gone, HistoryError where it is damaged."""
        self._path = path
        with _undamaged(path):
            self._footer = pq.read_metadata(path)
            counts: Mapping[str, int] = json.loads((self._footer.metadata or {}).get(_INDEX, b"{}"))
        ends = np.cumsum(np.fromiter(counts.values(), dtype=np.int64, count=len(counts)))
        self._rows = {tag: (int(end) - n, int(end)) for (tag, n), end in zip(counts.items(), ends, strict=True)}
        groups = [self._footer.row_group(k).num_rows for k in range(self._footer.num_row_groups)]
        self._starts = np.concatenate([[0], np.cumsum(groups, dtype=np.int64)]).astype(np.int64)

    @property
    def tags(self) -> tuple[str, ...]:
        """The tags that have rows, sorted."""
        return tuple(self._rows)

    def read(self, tags: Iterable[str], columns: Sequence[str]) -> Iterator[tuple[str, Columns]]:
        """Each of ``tags`` that has rows, in the order of the table, with these ``columns``; times are in [us]."""
        wanted = sorted((self._rows[tag], tag) for tag in set(tags) & self._rows.keys())
        if not wanted:
            return
        with _undamaged(self._path), pq.ParquetFile(self._path, metadata=self._footer) as file:
            held, table = range(0), dict[str, NDArray[Any]]()
            for (first, end), tag in wanted:
                groups = range(
                    int(np.searchsorted(self._starts, first, "right")) - 1, int(np.searchsorted(self._starts, end))
                )
                if groups != held:
                    held, table = groups, _columns(file.read_row_groups(list(groups), list(columns), use_threads=False))
                start = int(self._starts[groups.start])
                yield tag, {name: column[first - start : end - start] for name, column in table.items()}


def read_plain(path: Path, columns: Sequence[str]) -> Columns:
    """These ``columns`` of a table without tags; times are in [us], NO_TIME where there is none.

    Raises FileNotFoundError where it has gone, HistoryError where it is damaged.
    """
    with _undamaged(path), pq.ParquetFile(path) as file:
        return _columns(file.read(list(columns), use_threads=False))


def plain_table(schema: pa.Schema, columns: Mapping[str, Any]) -> pa.Table:
    """Columns as a table; times are in [us], and NO_TIME becomes null."""
    return pa.Table.from_arrays([_array(field, columns[field.name]) for field in schema], schema=schema)


def _array(field: "pa.Field[Any]", values: Any) -> Any:
    if pa.types.is_timestamp(field.type):
        return pa.array(values, type=pa.int64(), mask=values == NO_TIME).cast(_TIME)
    return pa.array(values, field.type)


def _columns(table: pa.Table) -> dict[str, NDArray[Any]]:
    found: dict[str, NDArray[Any]] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        if pa.types.is_timestamp(column.type):
            column = column.cast(pa.int64())
            if column.null_count:
                column = column.fill_null(pa.scalar(NO_TIME))
        found[name] = column.to_numpy()
    return found


def _groups(rows: Iterable[TagRows], most: int) -> Iterator[list[TagRows]]:
    """Tags that share a row group of about ``most`` rows."""
    group, length = list[TagRows](), 0
    for one in rows:
        n = len(next(iter(one.columns.values())))
        if group and length + n > most:
            yield group
            group, length = [], 0
        group.append(one)
        length += n
    if group:
        yield group


def _table(schema: pa.Schema, group: Sequence[TagRows]) -> pa.Table:
    lengths = [len(next(iter(one.columns.values()))) for one in group]
    numbers = np.repeat(np.arange(len(group), dtype=np.int32), lengths)
    tags = pa.DictionaryArray.from_arrays(numbers, pa.array([one.tag for one in group], pa.string()))
    made: list[Any] = [tags.cast(pa.string())]
    for field in list(schema)[1:]:
        values = np.concatenate([one.columns[field.name] for one in group])
        made.append(_array(field, values))
    return pa.Table.from_arrays(made, schema=schema)


def _writer(path: Path, schema: pa.Schema, first: pa.Table) -> pq.ParquetWriter:
    """A writer with the encoding of values that is the smallest for ``first``."""
    if "value" not in schema.names:
        return _open(path, schema, "dictionary")
    sizes = {encoding: _size(first, encoding) for encoding in _VALUE_ENCODINGS}
    return _open(path, schema, min(sizes, key=lambda encoding: sizes[encoding]))


def _size(table: pa.Table, encoding: str) -> int:
    """Bytes that the values of ``table`` take."""
    sink = pa.BufferOutputStream()
    values = table.select(["value"])
    with _open(sink, values.schema, encoding) as writer:
        writer.write_table(values)
    return len(sink.getvalue())


def _open(where: Path | pa.NativeFile, schema: pa.Schema, encoding: str) -> pq.ParquetWriter:
    counted = [f.name for f in schema if pa.types.is_timestamp(f.type) or pa.types.is_int64(f.type)]
    encodings = dict.fromkeys(counted, "DELTA_BINARY_PACKED")
    listed = [f.name for f in schema if f.name not in encodings]
    if encoding != "dictionary" and "value" in listed:
        listed.remove("value")
        encodings["value"] = encoding
    # Statistics of what nobody looks for by size make the footer large, and slow to read.
    sorted_by = [name for name in ("tag", "time", "minute") if name in schema.names]
    how: dict[str, Any] = {"use_dictionary": listed, "column_encoding": encodings, "write_statistics": sorted_by}
    return pq.ParquetWriter(where, schema, compression="zstd", compression_level=_LEVEL, store_schema=False, **how)


@contextmanager
def _undamaged(path: Path) -> Iterator[None]:
    """HistoryError that names ``path`` where the library finds something else in it than was written."""
    try:
        yield
    except (pa.ArrowException, ValueError, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:  # the library's own have none
            raise
        text = f"{str(path)!r} is damaged ({' '.join(str(error).split())[:200]})"
        raise HistoryError(f"{text}; move it out of the history, or put its copy there from a backup") from error


@final
class _Whole:
    """A file that is written beside its name, and gets it once it is on the disk."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.partial = path.with_name(path.name + PARTIAL)

    def __enter__(self) -> "_Whole":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                sync(self.partial)
                os.replace(self.partial, self._path)
                sync(self._path.parent)
        finally:
            self.partial.unlink(missing_ok=True)
