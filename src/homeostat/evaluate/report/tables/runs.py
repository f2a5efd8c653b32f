"""Tables that compare runs pair by pair, count who solved what, and name every run that failed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from homeostat.evaluate.report.groups import broke_limit, entrant, in_order, overall, source, succeeded
from homeostat.evaluate.report.measures.comparison import comparisons
from homeostat.evaluate.report.measures.diagnosis import reliability
from homeostat.evaluate.report.measures.scores import solvers
from homeostat.evaluate.report.tables.paper import WHO
from homeostat.evaluate.report.tables.table import Column, Kind, Table, compact
from homeostat.evaluate.study.row import Row

_CASE: Final = Column("case", Kind.TEXT)
_COMPARISON: Final = (
    _CASE,
    *WHO,
    Column("reference", Kind.TEXT, "what it is compared with"),
    Column("pairs", Kind.COUNT, "runs of both on the same plant with the same faults"),
    Column("both", Kind.COUNT, "pairs in which both succeeded"),
    Column("only this", Kind.COUNT, "pairs in which the reference did not succeed"),
    Column("only reference", Kind.COUNT, "pairs in which only the reference succeeded"),
    Column("neither", Kind.COUNT, "pairs in which neither succeeded"),
    Column("p", Kind.NUMBER, "probability of so unequal successes if both are equally good (McNemar, exact)", 4),
    Column("p, adjusted", Kind.NUMBER, "the same, adjusted for all comparisons in the case (Holm)", 4),
    Column("exposure, difference [s]", Kind.ESTIMATE, "mean difference of the time outside hard limits, this less the "
           "reference; 95 % bootstrap interval of pairs", 1),
    Column("loss, difference [%]", Kind.ESTIMATE, "the same of the production loss", 2, 100.0),
    Column("delay, difference [s]", Kind.ESTIMATE, "the same of the delay, where both completed their batch", 1),
)  # fmt: skip
_CALIBRATION: Final = (
    _CASE,
    *WHO,
    Column("from", Kind.NUMBER, "least probability of what was believed most", 1),
    Column("to", Kind.NUMBER, "largest probability", 1),
    Column("mean probability", Kind.NUMBER, "mean of these probabilities", 3),
    Column("true", Kind.RATE, "how often it was true; well calibrated where this agrees with the mean"),
)
FAILURES: Final = (
    Column("job", Kind.TEXT),
    _CASE,
    Column("scenario", Kind.TEXT),
    *WHO,
    Column("seed", Kind.COUNT),
    Column("what", Kind.TEXT, "no success, or success with a hard limit broken on the way"),
    Column("outcome", Kind.TEXT),
    Column("acted", Kind.TEXT),
    Column("state", Kind.TEXT, "state of the machine at the end"),
    Column("reason", Kind.TEXT, "why the fallback acted"),
    Column("exposure [s]", Kind.NUMBER, "longest true time outside any one hard limit", 0),
    Column("least margin", Kind.NUMBER, "least true margin to any hard limit, negative where broken", 2),
    Column("limit", Kind.TEXT, "the limit with that margin"),
)
_LEFT_ALONE: Final = "none"


def comparison_table(rows: Sequence[Row], reference: str | None = None) -> Table:
    """Every proposer against the reference."""
    lines = [
        (
            c.case, c.name, source(c.proposer).value, c.reference, c.pairs, c.both, c.only_this, c.only_reference,
            c.neither, c.p, c.p_adjusted, c.exposure, c.loss, c.delay,
        )
        for c in comparisons(rows, reference)
    ]  # fmt: skip
    note = "Pair by pair, on the same plant with the same faults. Differences below 0 are in favour of the proposer."
    return compact(Table("comparison", "Paired comparison with the reference", note, _COMPARISON, tuple(lines)))


def calibration_table(rows: Sequence[Row]) -> Table:
    """How often what was believed was true, by how much it was believed."""
    lines = [
        (group.case, group.name, group.source.value, one.low, one.high, one.believed, one.right)
        for group in overall(rows)
        for one in reliability(group.rows)
    ]
    note = "Last diagnoses before the first release, sorted by the probability of the most probable faults."
    return Table("calibration", "What a probability of the diagnosis is worth", note, _CALIBRATION, tuple(lines))


def actor_table(rows: Sequence[Row]) -> Table:
    """Who acted in the runs that succeeded, and what became of the others."""
    groups = overall(rows)
    solved = {id(group): solvers(group.rows) for group in groups}
    actors = sorted({name for one in solved.values() for name in one}, key=lambda name: (name == _LEFT_ALONE, name))
    columns = (
        _CASE, *WHO, Column("runs", Kind.COUNT),
        *(Column("left alone" if name == _LEFT_ALONE else f"by {name}", Kind.COUNT) for name in actors),
        Column("fallback", Kind.COUNT, "runs in which a fallback acted; none of them counts as a success"),
        Column("failed otherwise", Kind.COUNT, "runs without success in which no fallback acted"),
    )  # fmt: skip
    lines = []
    for group in groups:
        failed = [row for row in group.rows if not succeeded(row)]
        caught = sum(row.fallbacks > 0 for row in failed)
        by = (solved[id(group)].get(name, 0) for name in actors)
        lines.append((group.case, group.name, group.source.value, len(group.rows), *by, caught, len(failed) - caught))
    note = "Successes by who acted; a search may follow a language model that found nothing."
    return Table("actors", "Who solved it", note, columns, tuple(lines))


def failed(rows: Sequence[Row]) -> list[Row]:
    """Runs that did not succeed or broke a hard limit, in order."""
    return [row for row in in_order(rows) if not succeeded(row) or broke_limit(row)]


def failure_table(rows: Sequence[Row]) -> Table:
    """Every run that did not succeed or broke a hard limit."""
    lines = tuple(
        (
            row.job, row.case, row.scenario, entrant(row), source(row.proposer).value, row.seed, what_failed(row),
            row.outcome, row.actor, row.state, row.reason, row.exposure_s, row.least_margin, row.least_margin_limit,
        )
        for row in failed(rows)
    )  # fmt: skip
    note = "Runs of yardsticks fail by their nature where nobody may act." if lines else "There are none."
    return Table("failures", "Every run that failed or broke a hard limit", note, FAILURES, lines)


def what_failed(row: Row) -> str:
    """In a few words."""
    if succeeded(row):
        return "limit broken"
    return "no success, limit broken" if broke_limit(row) else "no success"
