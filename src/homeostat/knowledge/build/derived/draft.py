"""The tables of a plant while rows are added that follow from those that are stated."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TypeAlias

from homeostat.domain.plant.timing import Timing
from homeostat.knowledge.build.tables.reading import Origin, Rows
from homeostat.knowledge.build.tables.schemas import EVERY

Cells: TypeAlias = dict[str, str]
"""Column -> cell."""


def number(cell: str) -> float | None:
    """The finite number in a cell; None where there is none, which the check of the tables says."""
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def one_digit(value: float) -> float:
    """``value`` rounded to one significant digit."""
    return float(f"{value:.0e}")


def written(value: float) -> str:
    """``value`` as a cell has it."""
    return f"{value:.6g}"


@dataclass(frozen=True, slots=True)
class Line:
    """A row with where it comes from."""

    origin: Origin
    """Where it comes from."""
    cells: Cells
    """Column -> cell, empty where nothing is stated."""

    def __getitem__(self, column: str) -> str:
        """The cell of ``column``; empty where nothing is stated."""
        return self.cells.get(column, "")

    @property
    def follows(self) -> Origin:
        """Where a row comes from that follows from this one."""
        return Origin(self.origin.table, self.origin.line, generated=True)


class Draft:
    """Tables with the rows that are stated, and those that were added so far.

    A stated row comes before one that is added with the same key. It takes over cells of columns that its table leaves
    out, and of those that are empty and must not be; an empty cell of another column says that there is nothing.
    What the table of omitted rows names is not added.
    """

    def __init__(self, stated: Mapping[str, Rows], lines: Mapping[str, list[Line]], timing: Timing) -> None:
        """``stated`` says which tables and columns there are; ``lines`` are their rows, keys included."""
        self.timing = timing
        """How often the plant is sampled, and how fast it is."""
        self._columns = {name: frozenset(table.columns) for name, table in stated.items()}
        self._former = {name: table.former for name, table in stated.items()}
        self._lines = {name: list(lines.get(name, ())) for name in EVERY}
        self._places = {name: self._indexed(name) for name in EVERY}
        self._met: set[int] = set()

    def lines(self, name: str) -> tuple[Line, ...]:
        """The rows of a table, those that are stated first."""
        return tuple(self._lines[name])

    def find(self, name: str, *key: str) -> Line | None:
        """The row with this key, or None."""
        place = self._places[name].get(key)
        return None if place is None else self._lines[name][place]

    def states(self, name: str) -> bool:
        """Whether the plant has a file of this table."""
        return bool(self._columns.get(name))

    def column(self, name: str, column: str) -> frozenset[str]:
        """What stands in a column."""
        return frozenset(line[column] for line in self._lines[name]) - {""}

    def add(self, name: str, origin: Origin, cells: Cells) -> None:
        """Add a row, or fill the stated one with the same key; of two that are added the first counts."""
        place = self._places[name].get(self._key(name, cells))
        if place is None:
            if self._omits(name, cells):
                return
            self._places[name][self._key(name, cells)] = len(self._lines[name])
            self._lines[name].append(Line(origin, cells))
        elif not (line := self._lines[name][place]).origin.generated:
            self.fill(name, line, cells)

    def pass_over(self, name: str, cells: Cells) -> None:
        """Leave a row out; one that omits it all the same is not blamed for naming nothing."""
        self._omits(name, cells)

    def _omits(self, name: str, cells: Cells) -> bool:
        """Whether a row that follows is not wanted."""
        key = " ".join(self._key(name, cells))
        met = {
            number
            for number, line in enumerate(self._lines["omitted"])
            if line["table"] == name and fnmatchcase(key, line["row"])
        }
        self._met |= met
        return bool(met)

    @property
    def idle(self) -> tuple[int, ...]:
        """Numbers of the rows, from 0, of the table of omitted rows that named nothing that would have been added."""
        return tuple(number for number in range(len(self._lines["omitted"])) if number not in self._met)

    def fill(self, name: str, line: Line, cells: Cells) -> None:
        """Fill what a stated row leaves open; see the class."""
        fields = EVERY[name][0].model_fields
        for column, cell in cells.items():
            if not line[column] and (column not in self._columns[name] or fields[column].is_required()):
                line.cells[column] = cell

    def finished(self) -> dict[str, Rows]:
        """Every table with all its columns."""
        return {name: self._finished(name) for name in EVERY}

    def _finished(self, name: str) -> Rows:
        columns = tuple(EVERY[name][0].model_fields)
        lines = self._lines[name]
        rows = tuple({column: line[column] for column in columns} for line in lines)
        return Rows(columns, rows, self._former.get(name, {}), tuple(line.origin for line in lines))

    def _indexed(self, name: str) -> dict[tuple[str, ...], int]:
        found: dict[tuple[str, ...], int] = {}
        for place, line in enumerate(self._lines[name]):
            found.setdefault(self._key(name, line.cells), place)
        return found

    @staticmethod
    def _key(name: str, cells: Mapping[str, str]) -> tuple[str, ...]:
        return tuple(cells.get(column, "") for column in EVERY[name][1])


def lines_of(name: str, rows: Iterable[Mapping[str, str]]) -> list[Line]:
    """The rows of a file, each with its line."""
    return [Line(Origin(name, line), dict(row)) for line, row in enumerate(rows, start=2)]
