"""Scores: a heading, how its cells are computed and read; the table that scores make, and all those of a report.

No cell where nothing can be said: nobody was asked, or nothing of the kind happened.
"""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Final, Generic, TypeVar

from homeostat.evaluate.report.groups import Group, succeeded
from homeostat.evaluate.report.measures import References, Usage, asked, is_right
from homeostat.evaluate.report.statistics import Spread, estimate, pooled, rate, spread
from homeostat.evaluate.report.tables.table import Cell, Column, Kind, Table
from homeostat.record.row import Row

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


Scores = tuple[Score[Group], ...]
_NO_FAULT: Final = "none"
_TOTAL: Final = "total of a run: median (worst)"

SUCCESS: Final[Scores] = (
    share("success", succeeded),
    share("recovery", succeeded, among=lambda row: row.refused > 0),
    part("plan correctness", lambda row: row.plans_right, lambda row: row.plans),
    part("action correctness", lambda row: row.actions_right, lambda row: row.actions),
    part("precision", lambda row: row.on_right, lambda row: (row.on_right or 0) + (row.on_wrong or 0)),
    part("recall", lambda row: row.on_right, lambda row: (row.on_right or 0) + (row.on_missed or 0)),
)
_SAFETY: Final[Scores] = (
    share("no limit broken", lambda row: row.exposure_s <= 0.0),
    middle("exposure [s]", lambda row: row.exposure_s),
    middle("after detection [s]", lambda row: row.exposure_detected_s),
    middle("least margin", lambda row: row.least_margin, 2, more_is_better=True),
    Score(Column("closest limit", Kind.TEXT), lambda g: min((r.least_margin, r.least_margin_limit) for r in g.rows)[1]),
    middle("loss [%]", lambda row: row.production_loss, 1, 100.0),
    share("batches complete", lambda row: row.complete_s is not None, among=lambda row: row.batch),
    middle("delay [s]", lambda row: row.delay_s),
)
DIAGNOSIS: Final[Scores] = (
    share("detected", lambda row: row.detection_s is not None, among=lambda row: row.fault != _NO_FAULT),
    middle("detection delay [s]", lambda row: row.detection_s),
    share("false alarms", lambda row: row.false_alarm),
    share("diagnosis right", is_right, among=lambda row: row.believed),
    mean("probability of the truth", lambda row: row.true_p, 2),
    mean("Brier score", lambda row: row.brier, 2),
)
LATENCY: Final[Scores] = (
    middle("first decision [s]", lambda row: row.wall_decision_s, 2),
    middle("thinking [s]", lambda row: row.wall_thinking_s, 2),
    middle("call [s]", lambda row: row.wall_call_s, 2),
    mean("run [s]", lambda row: row.wall_s, 1),
)


def safety(rows: Iterable[Row]) -> Scores:
    """What the plant went through, with the totals in ``rows``; a total's name is a quantity, ``_`` and its unit."""
    return *_SAFETY, *map(_reported, sorted({name for row in rows for name in row.totals}))


def _reported(name: str) -> Score[Group]:
    quantity, _, unit = name.rpartition("_")
    score = middle(f"{quantity.replace('_', ' ')} [{unit}]", lambda row: row.totals.get(name), 2)
    return replace(score, column=replace(score.column, meaning=_TOTAL))


def _asked(of: Callable[[Usage], int]) -> Value:
    """Of the runs in which a model was asked."""
    return lambda row: of(used) if (used := asked(row)) else None


def _price(group: Group) -> Spread | None:
    """Price of the runs in which a model was asked [USD]; None where any is not known."""
    prices = [row.cost_usd for row in group.rows if asked(row)]
    known = [price for price in prices if price is not None]
    return spread(known) if len(known) == len(prices) else None


EFFORT: Final[Scores] = (
    count("runs asked", lambda group: sum(asked(row) is not None for row in group.rows)),
    middle("calls", _asked(lambda used: used.calls)),
    mean("tokens in [k]", _asked(lambda used: used.read), 1, 0.001),
    mean("tokens out [k]", _asked(lambda used: used.written), 2, 0.001),
    Score(Column("price [USD]", Kind.SPREAD, digits=4), _price),
    count("unanswered", lambda group: sum(row.failures for row in group.rows)),
    Score(
        Column("counted by", Kind.TEXT),
        lambda group: ", ".join(sorted({row.tokens_by for row in group.rows if asked(row) and row.tokens_by})),
    ),
)


def beside(known: References) -> Scores:
    """A group beside what is ``known`` to have been possible."""

    def loss(row: Row) -> float | None:
        possible = known.possible(row)
        if possible is None or row.batch or row.production_loss is None or possible.production_loss is None:
            return None
        return row.production_loss - possible.production_loss

    def later(row: Row) -> float | None:
        possible = known.possible(row)
        if possible is None or not row.batch or row.complete_s is None or possible.complete_s is None:
            return None
        return row.complete_s - possible.complete_s

    return (
        share("over-reaction", lambda row: row.acted, among=known.is_harmless),
        Score(Column("possible and missed", Kind.RATE), lambda group: known.missed(group.rows)),
        middle("loss beyond hindsight [%]", loss, 1, 100.0),
        middle("later than hindsight [s]", later),
    )
