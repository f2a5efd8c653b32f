"""Rows on disk: the ledger, each row the moment it is known, so that a study goes on, and the dataset of all."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from types import NoneType, TracebackType
from typing import Any, Self, final, get_args, get_type_hints

import pyarrow as pa
from pyarrow import parquet

from homeostat.evaluate.study.error import StudyError
from homeostat.record.row import FINGERPRINT, OWN, TOTALS, Row, columns_of, row_from

LEDGER = "rows.jsonl"
"""Name of the file in the study's folder."""


@final
class Ledger:
    """Rows of one study by the fingerprint of their job; one process at a time writes them."""

    def __init__(self, folder: Path) -> None:
        """Open the ledger in ``folder``; StudyError where another study is writing there."""
        self._made = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
        self._path = folder / LEDGER
        self._file = _locked(self._path)
        self._rows: dict[str, Row] = {}
        self._recover()

    @property
    def rows(self) -> Mapping[str, Row]:
        """Fingerprint -> row of everything that was done before or since."""
        return self._rows

    def add(self, fingerprint: str, row: Row) -> None:
        """Keep ``row`` for good; OSError where the disk does not take it, and then the next start makes it again."""
        left = (json.dumps({FINGERPRINT: fingerprint, **columns_of(row)}, allow_nan=False) + "\n").encode()
        before = os.fstat(self._file).st_size
        try:
            while left:  # a disk that is nearly full takes a part of a line, and says so at the next one only
                left = left[os.write(self._file, left) :]
            os.fsync(self._file)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, before)
            raise OSError(error.errno, os.strerror(error.errno or 0), str(self._path)) from error
        self._rows[fingerprint] = row

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if os.fstat(self._file).st_size == 0:  # a study that never began leaves nothing behind
            self._path.unlink(missing_ok=True)
            with contextlib.suppress(OSError):  # a folder with anything else in it stays
                if self._made:
                    self._path.parent.rmdir()
        os.close(self._file)  # this gives the lock back

    def _recover(self) -> None:
        """Read what is there; a last line that was cut off goes, and so does what another version wrote otherwise."""
        content = self._path.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if len(whole) < len(content):
            os.ftruncate(self._file, len(whole))
        for line in whole.splitlines():
            # Whatever else stands there is no row; such a row is made again.
            with contextlib.suppress(ValueError, TypeError, KeyError, AttributeError, RecursionError):
                kept: dict[str, Any] = json.loads(line)
                fingerprint = str(kept.pop(FINGERPRINT))
                self._rows[fingerprint] = row_from(kept)


def _locked(path: Path) -> int:
    """The file, opened for this process alone; StudyError where another one has it."""
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(file)
            raise StudyError(f"{str(path.parent)!r} is in use by another study; wait for it or choose --out") from None
        if os.fstat(file).st_nlink:
            return file
        os.close(file)  # whoever had it removed it between the two steps above


def in_order(fingerprints: Iterable[str], ledger: Ledger) -> list[Row]:
    """The rows of ``fingerprints``, in their order; those that are not there are left out."""
    return [ledger.rows[f] for f in fingerprints if f in ledger.rows]


DATASET = "results.parquet"
"""Name of the file in the study's folder."""
_TYPES: dict[Any, pa.DataType] = {str: pa.string(), bool: pa.bool_(), int: pa.int64(), float: pa.float64()}
_TYPES[tuple[float, ...]] = pa.list_(pa.float64())


def schema(totals: Iterable[str] = ()) -> pa.Schema:
    """Every column of a row with its type, and the ``totals`` of plants; those that may be None may be null."""
    hints = get_type_hints(Row)
    columns: list[pa.Field[Any]] = []
    for field in fields(Row):
        if field.name == TOTALS:
            columns += [_column(name, float | None) for name in totals]
        else:
            columns.append(_column(field.name, hints[field.name]))
    return pa.schema(columns)


def _column(name: str, kind: Any) -> pa.Field[Any]:
    nullable = NoneType in get_args(kind)
    return pa.field(name, _TYPES[get_args(kind)[0] if nullable else kind], nullable=nullable)


def write_dataset(path: Path, rows: Sequence[Row]) -> None:
    """Write ``rows`` to ``path``, which is the old or the new file whenever it is read."""
    totals = sorted({name for row in rows for name in row.totals})
    table = pa.Table.from_pylist([columns_of(row) for row in rows], schema=schema(totals))
    beside = path.with_suffix(".part")
    parquet.write_table(table, beside, compression="zstd")
    os.replace(beside, path)


def read_dataset(path: Path) -> list[Row]:
    """The rows in ``path``; StudyError where it holds something else, OSError where it cannot be read."""
    with path.open("rb") as file:
        try:
            table = parquet.read_table(file)
        except (pa.ArrowInvalid, OSError) as error:  # a torn file is either
            raise StudyError(f"{str(path)!r} is no dataset of a study: {' '.join(str(error).split())}") from None
    expected = schema(name for name in table.schema.names if name not in OWN)
    if (table.schema.names, table.schema.types) != (expected.names, expected.types):
        raise StudyError(f"{str(path)!r} has other columns than this version writes; run the study again")
    return [row_from(kept) for kept in table.to_pylist()]
