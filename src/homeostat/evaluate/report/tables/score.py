"""A score: a column's heading, how its cells are computed, and how they read; and the table that scores make."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Final, Generic, TypeVar

from homeostat.evaluate.report.groups import Group
from homeostat.evaluate.report.statistics import estimate, pooled, rate, spread
from homeostat.evaluate.report.tables.table import Cell, Column, Kind, Table
from homeostat.evaluate.study.row import Row

T = TypeVar("T")

Value = Callable[[Row], float | None]
"""A value of a run; None where it has none."""


@dataclass(frozen=True, slots=True)
class Words:
    """What a table says."""

    title: str
    """What it shows."""
    note: str
    """How to read it."""
    columns: Mapping[str, str]
    """Heading -> what it means, where the heading does not say it."""


@dataclass(frozen=True, slots=True)
class Score(Generic[T]):
    """One column of a table with one line for each ``T``."""

    column: Column
    """Heading, and how a cell reads."""
    of: Callable[[T], Cell]
    """What the cell holds."""


CASE: Final = Column("case", Kind.TEXT)
SCENARIO: Final = Column("scenario", Kind.TEXT)
PROPOSER: Final = Column("proposer", Kind.TEXT)
FIGURES: Final = Column("figures", Kind.TEXT)
WHO: Final[tuple[Score[Group], ...]] = (
    Score(PROPOSER, lambda group: group.name),
    Score(FIGURES, lambda group: group.source.value),
)
RUNS: Final[Score[Group]] = Score(Column("runs", Kind.COUNT), lambda group: len(group.rows))


def count(name: str, of: Callable[[T], int]) -> Score[T]:
    """A whole number."""
    return Score(Column(name, Kind.COUNT), of)


def share(name: str, truth: Callable[[Row], bool], among: Callable[[Row], object] = lambda row: True) -> Score[Group]:
    """How often something is so, of the runs of which ``among`` says that it could be."""
    return Score(Column(name, Kind.RATE), lambda group: rate([truth(row) for row in group.rows if among(row)]))


def part(name: str, some: Value, every: Value) -> Score[Group]:
    """The part of things of all runs that are so; those of one run do not stand for themselves."""
    return Score(Column(name, Kind.RATE), lambda group: pooled(_total(group, some), _total(group, every)))


def middle(name: str, of: Value, digits: int = 0, scale: float = 1.0, *, more_is_better: bool = False) -> Score[Group]:
    """Median and worst of the runs that have the value."""
    column = Column(name, Kind.SPREAD, digits=digits, scale=scale)
    return Score(column, lambda group: spread(_values(group, of), more_is_better=more_is_better))


def mean(name: str, of: Value, digits: int = 0, scale: float = 1.0) -> Score[Group]:
    """Mean of the runs that have the value, with its interval."""
    return Score(Column(name, Kind.ESTIMATE, digits=digits, scale=scale), lambda group: estimate(_values(group, of)))


def each(scores: Iterable[Score[Group]], group_of: Callable[[T], Group]) -> tuple[Score[T], ...]:
    """The scores of the group that an item belongs to."""

    def of_its_group(score: Score[Group]) -> Score[T]:
        return Score(score.column, lambda item: score.of(group_of(item)))

    return tuple(map(of_its_group, scores))


@cache
def words() -> Mapping[str, Words]:
    """What the tables of a report say: name of the table -> its words."""
    said = tomllib.loads(files(__package__).joinpath("words.toml").read_text(encoding="utf-8"))
    common = said.pop("columns")
    return {name: Words(one["title"], one["note"], {**common, **one["columns"]}) for name, one in said.items()}


def table(name: str, scores: Sequence[Score[T]], items: Iterable[T], said: Words | None = None) -> Table:
    """One line per item; ``said`` are its words, by default those of the report's table of that name."""
    said = said or words()[name]
    columns = tuple(replace(c, meaning=said.columns.get(c.name, c.meaning)) for c in (s.column for s in scores))
    lines = tuple(tuple(score.of(item) for score in scores) for item in items)
    return Table(name, said.title, said.note, columns, lines)


def _values(group: Group, of: Value) -> list[float]:
    return [value for row in group.rows if (value := of(row)) is not None]


def _total(group: Group, of: Value) -> int:
    return int(sum(_values(group, of)))
