"""A table of signals from a file, CSV or Parquet; what is wrong with it is one line."""

import contextlib
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.parquet

from homeostat.detectors.detector import Values
from homeostat.detectors.error import DetectionError
from homeostat.detectors.tables.table import SignalTable

MOST_BYTES: Final = 1 << 30
"""Largest file that is read [byte]."""
MOST_VALUES: Final = 10_000_000
"""Most values, rows times signals, that are judged at once."""
MOST_PACKED: Final = 10 * MOST_VALUES
"""Most values of a Parquet file that is read at all, before columns are left out."""
SEPARATORS: Final = ",;\t|"
"""What may stand between the values of a CSV file: what occurs most in its first line."""
TIMES: Final = ("time", "times", "datetime", "timestamp", "date", "time_s", "time [s]", "at_s")
"""Names of a column of times, in letters of whatever size."""
SHORT_TIMES: Final = ("t", "at")
"""Names of one in small letters alone: in capitals they are those of a temperature and of an analyser."""
_HEAD: Final = 65_536
"""Bytes at the begin of a file that say how it is written."""


def read_table(path: Path, time: str | None = None, ignored: Sequence[str] = ()) -> SignalTable:
    """The table in ``path``; ``time``: its column of times, the first that is called so by default.

    Columns ``ignored`` are left out. Raises DetectionError where it is no table of signals, OSError where it cannot be
    read.
    """
    size = path.stat().st_size
    if not path.is_file():
        raise DetectionError(f"{str(path)!r} is no file; a table is read twice, so it cannot come through a pipe")
    if size > MOST_BYTES:
        text = f"{str(path)!r} has {size / 2**30:.1f} GiB; at most {MOST_BYTES / 2**30:.0f} GiB are read"
        raise DetectionError(f"{text}; cut it into parts or take fewer rows")
    try:
        columns = _from_parquet(path) if path.suffix.lower() in (".parquet", ".pq") else _from_csv(path)
    except pa.ArrowException as error:
        raise DetectionError(f"{str(path)!r} is no table of signals: {' '.join(str(error).split()):.200}") from error
    return _table(str(path), columns, time, ignored)


def _from_parquet(path: Path) -> Any:
    """What is packed may be a thousand times as large: how much there is, is known beforehand."""
    with pa.parquet.ParquetFile(path) as file:
        if (count := file.metadata.num_rows * file.metadata.num_columns) > MOST_PACKED:
            text = f"{str(path)!r} has {file.metadata.num_rows} rows of {file.metadata.num_columns} columns"
            raise DetectionError(f"{text}, {count} values; at most {MOST_PACKED} are read: take fewer rows or columns")
        return file.read()


def _from_csv(path: Path) -> Any:
    with path.open("rb") as file:
        head = file.read(_HEAD)
    try:
        text = head.decode("utf-8-sig", errors="strict" if len(head) < _HEAD else "ignore")
    except UnicodeDecodeError:
        raise DetectionError(f"{str(path)!r} is no text in UTF-8; save it as CSV in UTF-8, or as Parquet") from None
    lines = text.splitlines()
    told = lines[0].strip().lower().removeprefix("sep=") if lines and lines[0].lower().startswith("sep=") else ""
    skipped = 1 if told and told in SEPARATORS else 0  # a line of spreadsheets, which says the separator
    lines = lines[skipped:]
    if not lines or not lines[0].strip():
        raise DetectionError(f"{str(path)!r} is empty; its first line must name the signals")
    separator = told if skipped else max(SEPARATORS, key=lines[0].count)
    sample = lines[1].split(separator) if len(lines) > 1 and separator != "," else []
    comma = any(cell.count(",") == 1 and cell.replace(",", "").strip(" -+").isdigit() for cell in sample)
    convert = pa.csv.ConvertOptions(decimal_point="," if comma else ".")
    read, parse = pa.csv.ReadOptions(skip_rows=skipped), pa.csv.ParseOptions(delimiter=separator)
    try:
        return pa.csv.read_csv(path, read_options=read, parse_options=parse, convert_options=convert)
    except pa.ArrowInvalid:
        _refuse_ragged(path, separator, skipped)
        raise


def _refuse_ragged(path: Path, separator: str, skipped: int) -> None:
    """DetectionError where a row has more or fewer cells than the first line; rows have numbers in one thread alone."""
    ragged: list[Any] = []

    def note(row: Any) -> Literal["skip"]:
        ragged.append(row)
        return "skip"

    read = pa.csv.ReadOptions(use_threads=False, skip_rows=skipped)
    with contextlib.suppress(pa.ArrowException):
        parse = pa.csv.ParseOptions(delimiter=separator, invalid_row_handler=note)
        pa.csv.read_csv(path, read_options=read, parse_options=parse)
    if ragged:
        row = ragged[0]
        text = f"row {row.number - 1 - skipped} has {row.actual_columns} cells"
        told = " ".join(row.text.split())
        remedy = "mend or cut out this row, or the first line"
        raise DetectionError(f"{path}: {text}, and the first line names {row.expected_columns}: {told!r:.60}; {remedy}")


def _table(name: str, columns: Any, time: str | None, ignored: Sequence[str]) -> SignalTable:
    try:
        names = [str(n).strip() for n in columns.schema.names]
    except UnicodeDecodeError:
        raise DetectionError(
            f"{name}: its names are no text in UTF-8; save it as CSV in UTF-8, or as Parquet"
        ) from None
    if "" in names and "" not in ignored:
        place = names.index("") + 1
        raise DetectionError(f"{name}: column {place} has no name; give it one, or leave it out with --ignore ''")
    twice = next((n for n in names if n and names.count(n) > 1), None)
    if twice is not None:
        raise DetectionError(
            f"{name}: the column {twice!r} is there {names.count(twice)} times; each needs a name of its own"
        )
    if all(_is_number(n) for n in names):
        raise DetectionError(
            f"{name}: the first line has numbers; it must name the signals, so put one with names above"
        )
    if columns.num_rows < 2:
        text = f"{name}: at least 2 rows are needed for a course of signals"
        raise DetectionError(f"{text}, and there are {columns.num_rows}; give it more")
    if time is not None and time not in names:
        raise DetectionError(f"{name}: there is no column {time!r} for the times; there are {_listed(names)}")
    if time is not None and time in ignored:
        raise DetectionError(f"{name}: the column {time!r} is both ignored and named for the times; say one of them")
    timed = time or next((n for n in names if n not in ignored and _is_time(n)), None)
    kept = [n for n in names if n != timed and n not in ignored]
    if not kept:
        raise DetectionError(f"{name}: no column of signals is left; there are {_listed(names)}")
    if len(kept) * columns.num_rows > MOST_VALUES:
        text = f"{name}: {columns.num_rows} rows of {len(kept)} signals are more than {MOST_VALUES} values"
        raise DetectionError(f"{text}; leave signals out with --ignore, or take fewer rows")
    values = np.stack([_numbers(name, n, columns.column(names.index(n))) for n in kept], axis=1)
    out = tuple(n for n in ignored if n in names)
    if timed is None:
        return SignalTable(name, tuple(kept), np.arange(len(values), dtype=np.float64), values, time=None, left_out=out)
    times, start = _times(name, timed, columns.column(names.index(timed)))
    return SignalTable(name, tuple(kept), times, values, start, timed, out)


def _numbers(name: str, signal: str, column: Any) -> Values:
    """The numbers of one column, NaN where there is none, shape (rows,)."""
    kind = column.type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if (
        pa.types.is_integer(kind)
        or pa.types.is_floating(kind)
        or pa.types.is_boolean(kind)
        or pa.types.is_decimal(kind)
    ):
        found: Values = np.asarray(
            column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False), dtype=np.float64
        )
        return found
    row, text = _first_text(column)
    remedy = f"leave the column out with --ignore {signal!r}, or name it with --time if it has the times"
    raise DetectionError(f"{name}: {text!r:.60} in row {row + 1} of {signal!r} is no number; {remedy}")


def _is_time(column_name: str) -> bool:
    return column_name in SHORT_TIMES or column_name.lower() in TIMES


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _first_text(column: Any) -> tuple[int, str]:
    if pa.types.is_temporal(column.type):  # Python has no times that are finer than a microsecond
        column = column.cast(pa.string())
    for row, value in enumerate(column.to_pylist()):
        if value is not None and not _is_number(str(value)):
            return row, str(value)
    return 0, str(column[0].as_py())


def _times(name: str, column_name: str, column: Any) -> tuple[Values, str]:
    """Rising times from 0 [s] and the moment of 0, in UTC with a Z where zones are stated; or numbers and no moment."""
    if column.null_count:
        row = column.is_null().index(True).as_py()
        raise DetectionError(f"{name}: row {row + 1} of {column_name!r} has no time; complete it, or cut the row out")
    start = ""
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        column = _moments(name, column_name, column.to_pylist())
    if pa.types.is_date(column.type) or pa.types.is_timestamp(column.type):
        whole = pa.timestamp("us", None if pa.types.is_date(column.type) else column.type.tz)
        try:  # the last digits of a nanosecond are cut off
            fine = pa.types.is_timestamp(column.type) and column.type.unit == "ns"
            cut = column.cast(whole, safe=not fine)
        except pa.ArrowInvalid:
            remedy = "correct it, or name another column with --time"
            raise DetectionError(f"{name}: {column_name!r} has a time beyond what a calendar has; {remedy}") from None
        moments = np.asarray(cut.cast(pa.int64()).to_numpy())
        start = str(np.datetime64(int(moments[0]), "us")) + ("Z" if whole.tz else "")
        times: Values = (moments - moments[0]) / 1e6
        shown: Any = moments.view("M8[us]")  # it shows also what no calendar has
    else:
        times, shown = _numbers(name, column_name, column), column
    back = np.flatnonzero(~(np.diff(times) > 0.0))
    if len(back):
        row = int(back[0]) + 1
        text = f"{name}: the time in row {row + 1} of {column_name!r} is not after the one before it"
        raise DetectionError(f"{text} ({str(shown[row]).removesuffix('.000000')}); sort the rows, each moment once")
    return times, start


def _moments(name: str, column_name: str, texts: Sequence[str]) -> Any:
    """Timestamps of ``texts``, in UTC where each has an offset."""
    found = []
    zoned = True
    for row, text in enumerate(texts):
        try:
            moment = datetime.fromisoformat(text.strip())
        except ValueError:
            remedy = "write ISO 8601, as 2026-11-25T13:00:00, or seconds, or name another column with --time"
            raise DetectionError(
                f"{name}: {text!r:.60} in row {row + 1} of {column_name!r} is no time; {remedy}"
            ) from None
        zoned = zoned and moment.tzinfo is not None
        try:
            found.append(moment.replace(tzinfo=None) - (moment.utcoffset() or moment - moment))
        except OverflowError:
            text = f"{name}: {text!r:.60} in row {row + 1} of {column_name!r} is in no year from 1 to 9999 in UTC"
            raise DetectionError(f"{text}; correct it, or name another column with --time") from None
    return pa.array(found, pa.timestamp("us", "UTC" if zoned else None))


def _listed(names: Sequence[str], most: int = 12) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(repr, names[:most])) + more
