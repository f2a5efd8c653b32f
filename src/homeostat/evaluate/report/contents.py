"""What a report holds, in its order."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from homeostat.evaluate.report import measures
from homeostat.evaluate.report.groups import Group, arm, by_scenario, in_order, overall, source, succeeded, violated
from homeostat.evaluate.report.tables.scores import (
    CASE,
    DIAGNOSIS,
    EFFORT,
    FIGURES,
    LATENCY,
    PROPOSER,
    RUNS,
    SCENARIO,
    SUCCESS,
    WHO,
    Score,
    Scores,
    beside,
    count,
    each,
    safety,
    table,
    words,
)
from homeostat.evaluate.report.tables.table import Column, Kind, Table, compact
from homeostat.record.row import HINDSIGHT, Row

_LEFT_ALONE: Final = "none"
_OVERALL: Final[Scores] = (Score(CASE, lambda group: group.case), *WHO)
_APART: Final[Scores] = (_OVERALL[0], Score(SCENARIO, lambda group: group.scenario), *WHO)
_COMPARISON: Final[tuple[Score[measures.Comparison], ...]] = (
    *each(_OVERALL, lambda c: c.group),
    Score(Column("reference", Kind.TEXT), lambda c: c.reference),
    count("pairs", lambda c: len(c.pairs)),
    count("both", lambda c: c.ended(True, True)),
    count("only this", lambda c: c.ended(True, False)),
    count("only reference", lambda c: c.ended(False, True)),
    count("neither", lambda c: c.ended(False, False)),
    Score(Column("p", Kind.NUMBER, digits=4), lambda c: c.p),
    Score(Column("p, adjusted", Kind.NUMBER, digits=4), lambda c: c.p_adjusted),
    Score(Column("exposure, difference [s]", Kind.ESTIMATE, digits=1), lambda c: c.difference(lambda r: r.exposure_s)),
    Score(
        Column("loss, difference [%]", Kind.ESTIMATE, digits=2, scale=100.0),
        lambda c: c.difference(lambda row: row.production_loss),
    ),
    Score(Column("delay, difference [s]", Kind.ESTIMATE, digits=1), lambda c: c.difference(lambda r: r.delay_s)),
)
_CALIBRATION: Final[tuple[Score[tuple[Group, measures.Bin]], ...]] = (
    *each(_OVERALL, lambda found: found[0]),
    Score(Column("from", Kind.NUMBER, digits=1), lambda found: found[1].low),
    Score(Column("to", Kind.NUMBER, digits=1), lambda found: found[1].high),
    Score(Column("mean probability", Kind.NUMBER, digits=3), lambda found: found[1].believed),
    Score(Column("true", Kind.RATE), lambda found: found[1].right),
)
_AGENTS: Final[tuple[Score[tuple[Group, measures.Tokens]], ...]] = (
    *each(_OVERALL, lambda found: found[0]),
    Score(Column("agent", Kind.TEXT), lambda found: found[1].agent),
    Score(Column("calls", Kind.SPREAD), lambda found: found[1].calls),
    Score(Column("tokens in", Kind.SPREAD), lambda found: found[1].read),
    Score(Column("tokens out", Kind.SPREAD), lambda found: found[1].written),
)
_FAILURES: Final[tuple[Score[Row], ...]] = (
    Score(Column("job", Kind.TEXT), lambda row: row.job),
    Score(CASE, lambda row: row.case),
    Score(SCENARIO, lambda row: row.scenario),
    Score(PROPOSER, arm),
    Score(FIGURES, lambda row: source(row.proposer).value),
    count("seed", lambda row: row.seed),
    Score(Column("what", Kind.TEXT), lambda row: what_failed(row)),
    Score(Column("outcome", Kind.TEXT), lambda row: row.outcome),
    Score(Column("acted", Kind.TEXT), lambda row: row.actor),
    Score(Column("state", Kind.TEXT), lambda row: row.state),
    Score(Column("reason", Kind.TEXT), lambda row: row.reason),
    Score(Column("exposure [s]", Kind.NUMBER), lambda row: row.exposure_s),
    Score(Column("least margin", Kind.NUMBER, digits=2), lambda row: row.least_margin),
    Score(Column("limit", Kind.TEXT), lambda row: row.least_margin_limit),
)


@dataclass(frozen=True, slots=True)
class Contents:
    """The tables of a study. Only those of ``times`` depend on the machine that it ran on."""

    main: tuple[Table, ...]
    """Over all scenarios of a plant."""
    times: tuple[Table, ...]
    """Wall-clock times."""
    details: tuple[Table, ...]
    """Scenario by scenario, and what a probability of the diagnosis is worth."""
    failures: Table
    """Every run that failed; it may have no line."""

    @property
    def tables(self) -> tuple[Table, ...]:
        """All of them."""
        return *self.main, *self.times, *self.details, self.failures


def contents(rows: Sequence[Row], reference: str | None = None) -> Contents:
    """The tables of ``rows``, in whatever order these are; tables without lines are left out.

    ``reference``: name of the proposer that others are compared with; by default the first in order.
    """
    ordered = in_order(rows)
    groups = overall(ordered)
    bins = [(group, one) for group in groups for one in measures.reliability(group.rows)]
    agents = [(group, one) for group in groups for one in measures.tokens_of(group.rows)]
    main = [
        *_scored(ordered, groups, _OVERALL, "", "all scenarios of a plant together"),
        table("comparison", _COMPARISON, measures.comparisons(ordered, reference)),
        table("actors", (*_OVERALL, RUNS, *_actors(ordered)), groups),
        table("agents", _AGENTS, agents),
    ]
    times = [table("latency", (*_OVERALL, RUNS, *LATENCY), groups)]
    details = [
        *_scored(ordered, by_scenario(ordered), _APART, "_by_scenario", "scenario by scenario"),
        table("calibration", _CALIBRATION, bins),
    ]
    return Contents(_shown(main), _shown(times), _shown(details), _failures(ordered))


def _shown(tables: Sequence[Table]) -> tuple[Table, ...]:
    return tuple(compact(one) for one in tables if one.lines)


def failed(rows: Sequence[Row]) -> list[Row]:
    """Runs that did not succeed or violated a hard limit, in order."""
    return [row for row in in_order(rows) if not succeeded(row) or violated(row)]


def what_failed(row: Row) -> str:
    """In a few words."""
    if succeeded(row):
        return "limit violated"
    return "no success, limit violated" if violated(row) else "no success"


def _scored(rows: Sequence[Row], groups: Sequence[Group], who: Scores, end: str, scope: str) -> list[Table]:
    """Success, safety, diagnosis, effort, and what was possible, of the same groups."""
    possible = beside(measures.References.among(rows))
    over_reaction, missed, *_ = possible
    compared = [g for g in groups if g.proposer != HINDSIGHT and (over_reaction.of(g) or missed.of(g))]
    asking = [g for g in groups if any(measures.asked(row) or row.failures for row in g.rows)]
    made = []
    for name, scores, shown in (
        ("success", SUCCESS, groups),
        ("safety", safety(rows), groups),
        ("diagnosis", DIAGNOSIS, groups),
        ("reference_policies", possible, compared),
        ("effort", EFFORT, asking),
    ):
        said = words()[name]
        titled = replace(said, title=said.title.format(scope=scope))
        made.append(table(f"{name}{end}", (*who, RUNS, *scores), shown, titled))
    return made


def _actors(rows: Sequence[Row]) -> Scores:
    """Who acted in runs that succeeded, and what became of the others."""
    names = {row.actor for row in rows if succeeded(row)}

    def solved(name: str) -> Score[Group]:
        heading = "left alone" if name == _LEFT_ALONE else f"by {name}"
        return count(heading, lambda group: sum(succeeded(row) and row.actor == name for row in group.rows))

    return (
        *map(solved, sorted(names, key=lambda name: (name == _LEFT_ALONE, name))),
        count("fallback", lambda group: sum(not succeeded(row) and row.fallbacks > 0 for row in group.rows)),
        count("failed otherwise", lambda group: sum(not succeeded(row) and row.fallbacks == 0 for row in group.rows)),
    )


def _failures(rows: Sequence[Row]) -> Table:
    """Every run that did not succeed or violated a hard limit, with all columns even where there is none."""
    found = table("failures", _FAILURES, failed(rows))
    return found if found.lines else replace(found, note="There are none.")
