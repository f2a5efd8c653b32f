"""Reading a table: a header of different columns, and as many cells in every row."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.vocabulary.former import COLUMNS, WORDS

FOLDER: Final = "engineering"
"""Where the tables are in a plant's folder."""
OPTIONAL: Final = frozenset({"prices"})
"""Tables that a plant's folder may lack, which is as if they had no row."""
OPTIONAL_COLUMNS: Final[Mapping[str, frozenset[str]]] = {
    "criteria": frozenset({"asks_after_s"}),
    "faults": frozenset({"mode"}),
    "trips": frozenset({"fastest", "fallen"}),
}
"""Table -> columns that it may lack, which is as if they had empty cells."""
SHORT: Final = frozenset({"guards", "instruments", "omitted", "streams"})
"""Tables from which rows of others follow; the mapping reads none of them."""
NEEDED: Final = frozenset(
    {"equipment", "fallbacks", "instruments", "limits", "parameters", "setpoints", "states", "transitions"}
)
"""Tables that a plant with a table of instruments may not lack."""


def is_short(folder: Path) -> bool:
    """Whether rows follow from others in the tables of the plant in ``folder``: it has a table of instruments."""
    return (folder / FOLDER / "instruments.csv").exists()


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a row of a table comes from."""

    table: str
    """The table whose file has the line."""
    line: int
    """Line of that file."""
    generated: bool = False
    """Whether the row follows from that line, and is not what stands there."""


@dataclass(frozen=True, slots=True)
class Rows:
    """The cells of one table."""

    columns: tuple[str, ...]
    """Its header."""
    rows: tuple[Mapping[str, str], ...]
    """Column -> cell, without spaces around it; row 0 is the second line of the file."""
    former: Mapping[str, str] = field(default_factory=dict)
    """Column -> what the file calls it, where that is a former name."""
    origins: tuple[Origin, ...] = ()
    """Where each row comes from; empty where row n is line n + 2 of the table's own file."""

    def place(self, name: str, number: int) -> str:
        """Where row ``number``, counted from 0, of the table called ``name`` stands, for messages."""
        origin = self.origins[number] if self.origins else Origin(name, number + 2)
        where = f"{origin.table}.csv row {origin.line}"
        return f"{name}.csv, a row that follows from {where}" if origin.generated else where

    def told(self, column: str) -> str:
        """``column`` as the file has it, with today's name behind a former one."""
        return _told(column, self.former)


def read_rows(path: Path, optional: bool = False) -> Rows:
    """The table in ``path``, with former names as those of today; without a row where it is ``optional`` and lacking.

    GraphError where it cannot be read, is ragged, or a cell begins or ends with a space.
    """
    if (optional or path.stem in OPTIONAL) and not path.exists():
        return Rows((), ())
    try:
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file, strict=True, restkey="", restval=None)
            rows = tuple(reader)
            written = tuple(reader.fieldnames or ())
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise GraphError(Code.BAD_TABLE, path.name, f"cannot be read: {error}") from error
    names, words = COLUMNS.get(path.stem, {}), WORDS.get(path.stem, {})
    header = tuple(names.get(column, column) for column in written)
    former = {names[column]: column for column in written if column in names}
    if not header or "" in header or len(set(header)) < len(header):
        has = [_told(names[c], former) if c in names else c for c in written]
        raise GraphError(Code.BAD_TABLE, path.name, f"needs a header of different column names, has {has}")
    for line, row in enumerate(rows, start=2):
        if "" in row or None in row.values():
            raise GraphError(
                Code.BAD_TABLE, f"{path.name} row {line}", f"needs {len(header)} cells; quote cells with commas"
            )
        if stray := [name for name, cell in row.items() if cell != cell.strip()]:
            column = _told(names.get(stray[0], stray[0]), former)
            raise GraphError(
                Code.BAD_TABLE, f"{path.name} row {line}", f"column {column!r} begins or ends with a space"
            )
    return Rows(
        header,
        tuple({names.get(c, c): words.get(c, {}).get(cell, cell) for c, cell in row.items()} for row in rows),
        former,
    )


def _told(column: str, former: Mapping[str, str]) -> str:
    return f"{former[column]} ({column})" if column in former else column
