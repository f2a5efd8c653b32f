"""The dataset: every row of a campaign as one Parquet file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from types import NoneType
from typing import Any, get_args, get_type_hints

import pyarrow as pa
from pyarrow import parquet

from homeostat.evaluate.study.error import CampaignError
from homeostat.evaluate.study.row import OWN, TOTALS, Row, columns_of, row_from

DATASET = "results.parquet"
"""Name of the file in the campaign's folder."""
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
    """The rows in ``path``; CampaignError where it holds something else, OSError where it cannot be read."""
    with path.open("rb") as file:
        try:
            table = parquet.read_table(file)
        except (pa.ArrowInvalid, OSError) as error:  # a torn file is either
            raise CampaignError(f"{str(path)!r} is no dataset of a campaign: {' '.join(str(error).split())}") from None
    expected = schema(name for name in table.schema.names if name not in OWN)
    if (table.schema.names, table.schema.types) != (expected.names, expected.types):
        raise CampaignError(f"{str(path)!r} has other columns than this version writes; run the campaign again")
    return [row_from(kept) for kept in table.to_pylist()]
