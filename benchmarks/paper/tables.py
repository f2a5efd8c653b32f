"""Tables in the paper's layout: one line per fault and proposer, the published figures beside ours."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from benchmarks.paper.names import file_name
from benchmarks.paper.published import Published, published_lines, published_rows
from homeostat.evaluate.report.groups import ALL, Group, grouped, in_order, overall, plants
from homeostat.evaluate.report.statistics import Estimate, Rate, wilson
from homeostat.evaluate.report.tables.scores import EFFORT, RUNS, SUCCESS, WHO, Score, Words, mean, table, words
from homeostat.evaluate.report.tables.table import Cell, Column, Kind, Percent, Table, compact
from homeostat.record.row import Row

RUN: Final = "those run"
"""Name of the last row where some of the published rows were not run."""
TOKENS: Final = tuple(score for score in EFFORT if score.column.name.startswith("tokens"))
SAID: Final = words()["success"].columns
MEANINGS: Final = {
    **SAID,
    "figures": SAID["figures"].replace(", or reference policy", ", reference policy, or published"),
    "tokens in [k]": "tokens of all questions of a run, mean over the runs in which a model was asked; "
    "95 % bootstrap interval",
    "tokens out [k]": "tokens of all answers of a run, likewise",
    "mean call [s]": "mean time of a model's answer",
    "mean run [s]": "wall-clock time of a whole run, simulation included; ours on this machine, theirs on another",
}
"""Of the columns; a study's own report says some of them otherwise."""


@dataclass(frozen=True)
class Line:
    """One line: ours or theirs."""

    fault: str
    """Row of the published table, or what stands in its place."""
    of: Group | Published
    """Whose figures."""


def beside(score: Score[Group], theirs: Callable[[Published], Cell]) -> Score[Line]:
    """A score of ours, or the published figure of the same."""

    def cell(line: Line) -> Cell:
        return theirs(line.of) if isinstance(line.of, Published) else score.of(line.of)

    return Score(score.column, cell)


def _percent(value: float | None) -> Percent | None:
    return None if value is None else Percent(value)


def _mean(value: float | None) -> Estimate | None:
    return None if value is None else Estimate(value, None)


def _counted(count: int, of: int) -> Rate:
    return Rate(count, of, wilson(count, of))


def _recovery(line: Published) -> Rate | Percent | None:
    counted = line.recovered is not None and line.reprompted
    return _counted(line.recovered, line.reprompted) if counted else _percent(line.recovery)


WHOSE: Final = (
    Score(Column("fault", Kind.TEXT), lambda line: line.fault),
    beside(WHO[0], lambda line: line.model),
    beside(WHO[1], lambda line: line.origin),
)
SCORES: Final = (
    beside(RUNS, lambda line: line.runs),
    *map(
        beside,
        (*SUCCESS, *TOKENS),
        (
            lambda line: _counted(line.successes, line.runs),
            _recovery,
            lambda line: _percent(line.plans),
            lambda line: _percent(line.actions),
            lambda line: _percent(line.precision),
            lambda line: _percent(line.recall),
            lambda line: _mean(line.tokens_in),
            lambda line: _mean(line.tokens_out),
        ),
    ),
)
TIMES: Final = (
    beside(mean("mean call [s]", lambda row: row.wall_call_s, 2), lambda line: _mean(line.call_s)),
    beside(mean("mean run [s]", lambda row: row.wall_s, 1), lambda line: _mean(line.time_s)),
)


def paper_tables(rows: Sequence[Row]) -> list[Table]:
    """One table per plant with rows that stand for published ones."""
    return [
        _table("paper", plant, f"{plant}: the paper's table", _note(plant, lines), (*WHOSE, *SCORES), lines)
        for plant, lines in _cases(rows)
    ]


def paper_latency(rows: Sequence[Row]) -> list[Table]:
    """The same with the times; they depend on the machine."""
    note = "Means with 95 % bootstrap intervals. The paper's times are those of its machines and providers."
    return [
        _table("latency", plant, f"{plant}: times beside the paper's", note, (*WHOSE, *TIMES), lines)
        for plant, lines in _cases(rows)
    ]


def _table(name: str, plant: str, title: str, note: str, scores: Sequence[Score[Line]], lines: Sequence[Line]) -> Table:
    said = Words(title, note, MEANINGS)
    return compact(table(file_name(name, plant), scores, lines, said))


def _cases(rows: Sequence[Row]) -> Iterator[tuple[str, list[Line]]]:
    """The plants with rows that stand for published ones, with the lines of their tables."""
    ordered = in_order(row for row in rows if row.published)
    for plant in plants(ordered):
        yield plant, list(_listed(plant, [row for row in ordered if row.case == plant]))


def _listed(plant: str, rows: Sequence[Row]) -> Iterator[Line]:
    """Our groups and the published lines of one plant, in the order of the published table."""
    groups, known = by_published(rows), published_rows(plant)
    run = {group.scenario for group in groups}
    for name in (*(row for row in known if row in run), *sorted(run - set(known))):
        yield from (Line(name, group) for group in groups if group.scenario == name)
        yield from (Line(name, line) for line in published_lines(plant, name))
    whole = run >= set(known)
    yield from (Line(ALL if whole else RUN, group) for group in overall(rows))
    if whole:
        yield from (Line(ALL, line) for line in published_lines(plant, ALL))


def by_published(rows: Sequence[Row]) -> list[Group]:
    """One group per plant, row of the published tables, proposer and ablation; rows without one are left out."""
    return grouped((row for row in rows if row.published), lambda row: row.published)


def _note(plant: str, listed: Sequence[Line]) -> str:
    remarks: dict[str, list[str]] = {}
    for line in listed:
        if isinstance(line.of, Published) and line.of.remark:
            remarks.setdefault(f"{line.of.model} ({line.of.origin}), {{}}: {line.of.remark}.", []).append(line.fault)
    lead = "Rates with 95 % Wilson intervals, means with 95 % bootstrap intervals; published means have none."
    if missing := [row for row in published_rows(plant) if row not in {line.fault for line in listed}]:
        lead += f" Of the published rows {', '.join(missing)} were not run."
    return " ".join([lead, *(text.format(", ".join(names)) for text, names in remarks.items())])
