"""A table of results: typed cells, and how each of them reads."""

from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from homeostat.evaluate.report.statistics import Estimate, Rate, Spread

EMPTY: Final = "–"
"""What stands in a cell of which nothing can be said."""


@dataclass(frozen=True, slots=True)
class Percent:
    """A rate whose counts are not known."""

    value: float
    """Rate [%]."""


Cell = str | int | float | Rate | Percent | Spread | Estimate | None
"""What one cell holds; None where nothing can be said."""


class Kind(Enum):
    """What the cells of a column hold."""

    TEXT = "text"
    """Words."""
    COUNT = "count"
    """Whole numbers."""
    NUMBER = "number"
    """Any numbers."""
    RATE = "rate"
    """Rates, or percentages where no more is known."""
    SPREAD = "spread"
    """Medians with the worst value."""
    ESTIMATE = "estimate"
    """Means with their interval."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column."""

    name: str
    """Heading, with the unit."""
    kind: Kind
    """What its cells hold."""
    meaning: str = ""
    """What the score means, in one line; empty where the heading says it."""
    digits: int = 0
    """Digits behind the point."""
    scale: float = 1.0
    """By what numbers are multiplied to be in the heading's unit."""


@dataclass(frozen=True, slots=True)
class Table:
    """A table."""

    name: str
    """Name of its files, without ending."""
    title: str
    """What it shows."""
    note: str
    """How to read it."""
    columns: tuple[Column, ...]
    """Its columns."""
    lines: tuple[tuple[Cell, ...], ...]
    """Its lines, one cell per column."""

    def __post_init__(self) -> None:
        """ValueError where a line has another number of cells than there are columns."""
        if odd := [line for line in self.lines if len(line) != len(self.columns)]:
            raise ValueError(f"table {self.name!r} has {len(self.columns)} columns, a line has {len(odd[0])} cells")

    @property
    def header(self) -> tuple[str, ...]:
        """The headings."""
        return tuple(column.name for column in self.columns)


def compact(table: Table) -> Table:
    """The table without the columns that say nothing in any line."""
    kept = [i for i in range(len(table.columns)) if any(line[i] not in (None, "") for line in table.lines)]
    return replace(
        table,
        columns=tuple(table.columns[i] for i in kept),
        lines=tuple(tuple(line[i] for i in kept) for line in table.lines),
    )


def said(cell: Cell, column: Column) -> str:
    """How a cell reads, on one line."""
    match cell:
        case None | "":
            return EMPTY
        case str():
            return one_line(cell)
        case Rate():
            return _rate(cell)
        case Percent():
            return f"{cell.value:.1f} %"
        case Spread():
            return f"{number(cell.median, column)} ({number(cell.worst, column)})"
        case Estimate():
            i = cell.interval
            ends = "" if i is None else f" ({number(i.low, column)} to {number(i.high, column)})"
            return f"{number(cell.mean, column)}{ends}"
        case _:
            return number(cell, column)


def number(value: float, column: Column) -> str:
    """A number in the column's unit and with its digits; zero has no sign."""
    text = f"{value * column.scale:.{column.digits}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text


def one_line(text: str) -> str:
    """``text`` without line breaks and other characters that cannot be seen."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _rate(cell: Rate) -> str:
    if cell.interval is None:
        return f"{100.0 * cell.share:.1f} % ({cell.count}/{cell.of})"
    return f"{cell.count}/{cell.of} ({100.0 * cell.interval.low:.0f}–{100.0 * cell.interval.high:.0f} %)"
