"""Tables in the paper's layout: one line per fault and proposer, the published figures beside ours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from homeostat.evaluate.report.groups import ALL, Group, by_published, cases, overall
from homeostat.evaluate.report.measures.scores import effort_of, latency_of, success_of
from homeostat.evaluate.report.statistics import Estimate, Rate, wilson
from homeostat.evaluate.report.tables.published import Published, published_lines, published_rows
from homeostat.evaluate.report.tables.table import Cell, Column, Kind, Percent, Table, compact, file_name
from homeostat.evaluate.study.row import Row

RUN: Final = "those run"
"""Name of the last row where some of the published rows were not run."""
WHO: Final = (
    Column("proposer", Kind.TEXT),
    Column("figures", Kind.TEXT, "measured, replayed (recorded answers of a model said again), scripted (a script in a "
           "model's place; it says nothing about any model), yardstick, or published"),
)  # fmt: skip
SUCCESS: Final = Column(
    "success", Kind.RATE, "runs that ended inside every hard limit, a batch complete, and without a fallback; 95 % "
    "Wilson interval",
)  # fmt: skip
STEPS: Final = (
    SUCCESS,
    Column("recovery", Kind.RATE, "successes among the runs in which at least one proposal was refused"),
    Column("plan correctness", Kind.RATE, "next states that were named rightly; no interval, because the questions of "
           "one run do not stand for themselves"),
    Column("action correctness", Kind.RATE, "sets of actuators that were named rightly"),
    Column("precision", Kind.RATE, "actuators that had to be on, among those switched on"),
    Column("recall", Kind.RATE, "actuators that were switched on, among those that had to be"),
)  # fmt: skip
_TOKENS: Final = (
    Column("tokens in [k]", Kind.ESTIMATE, "tokens of all questions of a run, mean over the runs in which a model was "
           "asked; 95 % bootstrap interval", 1, 0.001),
    Column("tokens out [k]", Kind.ESTIMATE, "tokens of all answers of a run, likewise", 2, 0.001),
)  # fmt: skip
TIMES: Final = (
    Column("call [s]", Kind.SPREAD, "mean time of a model's answer in a run: median over runs (worst)", 2),
    Column("run [s]", Kind.ESTIMATE, "wall-clock time of a whole run, simulation included: mean, 95 % bootstrap "
           "interval", 1),
)  # fmt: skip


def paper_tables(rows: Sequence[Row]) -> list[Table]:
    """One table per case with rows that stand for published ones."""
    columns = (Column("fault", Kind.TEXT), *WHO, Column("runs", Kind.COUNT), *STEPS, *_TOKENS)
    return [
        compact(
            Table(
                file_name("paper", case), f"{case}: the paper's table", _note(case, listed), columns,
                tuple((name, *(_ours(one) if isinstance(one, Group) else _theirs(one))) for name, one in listed),
            )
        )
        for case in cases(rows)
        if (listed := list(_listed([row for row in rows if row.case == case])))
    ]  # fmt: skip


def paper_latency(rows: Sequence[Row]) -> list[Table]:
    """The same with the times; they depend on the machine."""
    columns = (
        Column("fault", Kind.TEXT), *WHO, Column("mean call [s]", Kind.ESTIMATE, "mean time of a model's answer", 2),
        Column("mean run [s]", Kind.ESTIMATE, "wall-clock time of a whole run, simulation included; ours on this "
               "machine, theirs on another", 1),
    )  # fmt: skip
    return [
        compact(
            Table(
                file_name("latency", case), f"{case}: times beside the paper's",
                "Means with 95 % bootstrap intervals. The paper's times are those of its machines and providers.",
                columns, tuple((name, *_times(one)) for name, one in listed),
            )
        )
        for case in cases(rows)
        if (listed := list(_listed([row for row in rows if row.case == case])))
    ]  # fmt: skip


def _listed(rows: Sequence[Row]) -> Iterator[tuple[str, Group | Published]]:
    """Our groups and the published lines of one case, in the order of the published table."""
    groups = by_published(rows)
    if not groups:
        return
    case = groups[0].case
    known = published_rows(case)
    run = {group.scenario for group in groups}
    for name in (*(row for row in known if row in run), *sorted(run - set(known))):
        yield from ((name, group) for group in groups if group.scenario == name)
        yield from ((name, line) for line in published_lines(case, name))
    whole = run >= set(known)
    last = overall(row for row in rows if row.published)
    yield from ((ALL if whole else RUN, group) for group in last)
    if whole:
        yield from ((ALL, line) for line in published_lines(case, ALL))


def _ours(group: Group) -> tuple[Cell, ...]:
    scores, effort = success_of(group.rows), effort_of(group.rows)
    return (
        group.name, group.source.value, scores.n, scores.success, scores.recovery, scores.plans, scores.actions,
        scores.precision, scores.recall, effort.read, effort.written,
    )  # fmt: skip


def _theirs(line: Published) -> tuple[Cell, ...]:
    recovery: Rate | Percent | None = _percent(line.recovery)
    if line.recovered is not None and line.reprompted:
        recovery = _counted(line.recovered, line.reprompted)
    return (
        line.model, line.origin.value, line.runs, _counted(line.successes, line.runs), recovery, _percent(line.plans),
        _percent(line.actions), _percent(line.precision), _percent(line.recall), _mean(line.tokens_in),
        _mean(line.tokens_out),
    )  # fmt: skip


def _times(one: Group | Published) -> tuple[Cell, ...]:
    if isinstance(one, Group):
        latency = latency_of(one.rows)
        return one.name, one.source.value, latency.mean_call, latency.run
    return one.model, one.origin.value, _mean(one.call_s), _mean(one.time_s)


def _note(case: str, listed: Sequence[tuple[str, Group | Published]]) -> str:
    remarks: dict[str, list[str]] = {}
    for name, one in listed:
        if isinstance(one, Published) and one.remark:
            remarks.setdefault(f"{one.model} ({one.origin.value}), {{}}: {one.remark}.", []).append(name)
    lead = "Rates with 95 % Wilson intervals, means with 95 % bootstrap intervals; published means have none."
    if missing := [row for row in published_rows(case) if row not in {name for name, _ in listed}]:
        lead += f" Of the published rows {', '.join(missing)} were not run."
    return " ".join([lead, *(text.format(", ".join(names)) for text, names in remarks.items())])


def _counted(count: int, of: int) -> Rate:
    return Rate(count, of, wilson(count, of))


def _percent(value: float | None) -> Percent | None:
    return None if value is None else Percent(value)


def _mean(value: float | None) -> Estimate | None:
    return None if value is None else Estimate(value, None)
