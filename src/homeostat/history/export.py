"""Samples or minutes as one file for somebody else: CSV or Parquet, by tag and time."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.csv as pc
import pyarrow.parquet as pq

from homeostat.history.quality import severity
from homeostat.history.samples import MINUTE_US, NO_TIME, Minutes, Series, Span
from homeostat.history.store import HistoryError, HistoryReader

FORMATS: Final = (".csv", ".parquet")
"""Endings of files that can be written."""
_CHUNK_US: Final = 86_400_000_000
"""How much of a tag is in memory at once [us]."""
_TIME: Final = pa.timestamp("us", "UTC")
_CLASSES: Final = np.array(["good", "uncertain", "bad", "bad"])


def _schema(**fields: pa.DataType) -> pa.Schema:
    return pa.schema([pa.field(name, kind) for name, kind in fields.items()])


_NUMBER: Final = pa.float64()
_SAMPLES: Final = _schema(
    tag=pa.string(),
    time=_TIME,
    value=_NUMBER,
    quality=pa.string(),
    status=pa.uint32(),
    server_time=_TIME,
    own_time=_TIME,
)
_MINUTES: Final = _schema(
    tag=pa.string(),
    minute=_TIME,
    minimum=_NUMBER,
    maximum=_NUMBER,
    mean=_NUMBER,
    last=_NUMBER,
    last_time=_TIME,
    good=pa.int64(),
    count=pa.int64(),
)


def export(history: HistoryReader, tags: Sequence[str], span: Span, path: Path, minutes: bool) -> int:
    """Write the samples of ``tags`` inside ``span``, or their ``minutes``, to ``path``; the number of rows.

    The ending of ``path`` says in which format. The file is there as a whole, or not at all. Raises HistoryError for
    another ending, UnknownTag, and OSError where it cannot be written.
    """
    if path.suffix not in FORMATS:
        raise HistoryError(f"{str(path)!r} must end with {' or '.join(FORMATS)}, which says in which format to write")
    schema, rows = _MINUTES if minutes else _SAMPLES, 0
    beside = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with _opened(beside, path.suffix, schema) as writer:
            for table in _tables(history, tags, span, schema, minutes):
                writer.write_table(table)
                rows += table.num_rows
        os.replace(beside, path)
    except OSError as error:  # it names the file beside
        raise OSError(error.errno, os.strerror(error.errno or 0), str(path)) from error
    finally:
        beside.unlink(missing_ok=True)
    return rows


def _opened(path: Path, suffix: str, schema: pa.Schema) -> Any:
    return pc.CSVWriter(path, schema) if suffix == ".csv" else pq.ParquetWriter(path, schema, compression="zstd")


def _tables(
    history: HistoryReader, tags: Sequence[str], span: Span, schema: pa.Schema, minutes: bool
) -> Iterator[pa.Table]:
    extent = history.extent()
    if extent is None:
        return
    first_us, end_us = max(span.from_us, extent.from_us), min(span.to_us, extent.to_us)
    if minutes:
        first_us -= first_us % MINUTE_US  # the minute in which it begins belongs to it
    for tag in tags:
        for from_us in range(first_us, end_us, _CHUNK_US) or [first_us]:  # once in any case: is there such a tag?
            part = Span(from_us, max(min(from_us + _CHUNK_US, end_us), from_us))
            of_tag: Series | Minutes = history.minutes([tag], part)[tag] if minutes else history.read([tag], part)[tag]
            columns = _of_minutes(of_tag) if isinstance(of_tag, Minutes) else _of_samples(of_tag)
            named = [pa.array([tag] * of_tag.length, pa.string()), *columns]
            yield pa.Table.from_arrays(named, schema=schema)


def _of_samples(series: Series) -> list[Any]:
    measured = pa.array(series.value), pa.array(_CLASSES[severity(series.quality)]), pa.array(series.quality)
    return [_times(series.time_us), *measured, _times(series.server_us), _times(series.own_us)]


def _of_minutes(minutes: Minutes) -> list[Any]:
    values = (pa.array(column) for column in (minutes.minimum, minutes.maximum, minutes.mean, minutes.last))
    counts = pa.array(minutes.good), pa.array(minutes.count)
    return [_times(minutes.minute_us), *values, _times(minutes.last_us), *counts]


def _times(values: Any) -> Any:
    return pa.array(values, type=pa.int64(), mask=values == NO_TIME).cast(_TIME)
