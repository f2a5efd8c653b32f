"""Tables of one line per proposer: over all scenarios of a case, or scenario by scenario."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from homeostat.evaluate.report.groups import Group, by_scenario, overall
from homeostat.evaluate.report.measures.diagnosis import diagnosis_of
from homeostat.evaluate.report.measures.references import Against, against, yardsticks
from homeostat.evaluate.report.measures.safety import safety_of
from homeostat.evaluate.report.measures.scores import effort_of, latency_of, success_of
from homeostat.evaluate.report.tables.paper import STEPS, TIMES, WHO
from homeostat.evaluate.report.tables.table import Cell, Column, Kind, Table, compact
from homeostat.evaluate.study.row import HINDSIGHT, Row

_CASE: Final = Column("case", Kind.TEXT)
_SCENARIO: Final = Column("scenario", Kind.TEXT)
_RUNS: Final = Column("runs", Kind.COUNT)
_SAFETY: Final = (
    Column("no limit broken", Kind.RATE, "runs in which the plant truly never left a hard limit; 95 % Wilson interval"),
    Column("exposure [s]", Kind.SPREAD, "longest true time outside any one hard limit: median (worst)"),
    Column("after detection [s]", Kind.SPREAD, "the same from detection on, where something was detected"),
    Column("least margin", Kind.SPREAD, "least true margin to any hard limit in scales of its unit, negative where "
           "broken: median (worst)", 2),
    Column("closest limit", Kind.TEXT, "the limit with the worst margin"),
    Column("loss [%]", Kind.SPREAD, "part of the fault-free production that was lost: median (worst)", 1, 100.0),
    Column("batches complete", Kind.RATE, "batches that were completed; 95 % Wilson interval"),
    Column("delay [s]", Kind.SPREAD, "how much later than fault-free completed batches were: median (worst)"),
    Column("spilled [L]", Kind.SPREAD, "volume that leaked or overflowed: median (worst)", 2),
)  # fmt: skip
_DIAGNOSIS: Final = (
    Column("detected", Kind.RATE, "runs with a fault in which something was reported after its onset"),
    Column("detection delay [s]", Kind.SPREAD, "from onset to the first report, where there was one: median (worst)"),
    Column("false alarms", Kind.RATE, "runs in which something was reported before any onset"),
    Column("diagnosis right", Kind.RATE, "diagnoses whose most probable faults were the true ones"),
    Column("probability of the truth", Kind.ESTIMATE, "mean probability given to the true faults; 95 % bootstrap "
           "interval", 2),
    Column("Brier score", Kind.ESTIMATE, "mean squared error of the probabilities: 0 certain and right, 2 certain and "
           "wrong", 2),
)  # fmt: skip
_YARDSTICKS: Final = (
    Column("over-reaction", Kind.RATE, "runs that acted, among those that succeed inside every limit if nobody acts"),
    Column("possible and missed", Kind.RATE, "runs that did not succeed, among those in which it was possible by "
           "hindsight"),
    Column("loss beyond hindsight [%]", Kind.SPREAD, "production loss beyond the best by hindsight: median (worst)", 1,
           100.0),
    Column("later than hindsight [s]", Kind.SPREAD, "completion after the best by hindsight: median (worst)"),
)  # fmt: skip
_EFFORT: Final = (
    Column("runs asked", Kind.COUNT, "runs in which a language model was asked"),
    Column("calls", Kind.SPREAD, "questions per run: median (worst)"),
    Column("tokens in [k]", Kind.ESTIMATE, "tokens of all questions of a run: mean, 95 % bootstrap interval", 1, 0.001),
    Column("tokens out [k]", Kind.ESTIMATE, "tokens of all answers of a run, likewise", 2, 0.001),
    Column("price [USD]", Kind.SPREAD, "price of a run by the provider's list: median (worst)", 4),
    Column("unanswered", Kind.COUNT, "questions that got no answer, all runs together"),
    Column("counted by", Kind.TEXT, "who counted the tokens"),
)
_AGENTS: Final = (
    Column("agent", Kind.TEXT),
    Column("calls", Kind.SPREAD, "its questions per run: median (worst)"),
    Column("tokens in", Kind.SPREAD, "tokens of its questions per run: median (worst)"),
    Column("tokens out", Kind.SPREAD, "tokens of its answers per run: median (worst)"),
)
_LATENCY: Final = (
    Column("first decision [s]", Kind.SPREAD, "thinking until the first action: median (worst)", 2),
    Column("thinking [s]", Kind.SPREAD, "all thinking of a run: median (worst)", 2),
    *TIMES,
)

Cells = tuple[Cell, ...]


def score_tables(rows: Sequence[Row]) -> list[Table]:
    """Tables over all scenarios of a case."""
    return _tables(rows, overall, "", "all scenarios of a case together")


def scenario_tables(rows: Sequence[Row]) -> list[Table]:
    """The same, scenario by scenario."""
    return _tables(rows, by_scenario, "_by_scenario", "scenario by scenario")


def latency_table(rows: Sequence[Row]) -> Table:
    """Times; they depend on the machine."""
    return _table(
        "latency", "Times of thinking and of runs", "Wall-clock times of the machine that the runs were made on.",
        _LATENCY, overall(rows), _latency,
    )  # fmt: skip


def agent_table(rows: Sequence[Row]) -> Table:
    """Questions and tokens of every agent that asked a language model."""
    columns = (_CASE, *WHO, *_AGENTS)
    lines = [
        (g.case, g.name, g.source.value, a.agent, a.calls, a.read, a.written)
        for g in overall(rows)
        for a in effort_of(g.rows).agents
    ]
    note = "Over the runs in which a model was asked."
    return Table("agents", "Questions and tokens per agent", note, columns, tuple(lines))


def _tables(rows: Sequence[Row], grouped: Callable[[Sequence[Row]], list[Group]], end: str, scope: str) -> list[Table]:
    """Success, safety, diagnosis, yardsticks and effort of the same groups; those without anything are left out."""
    groups = grouped(rows)
    known = yardsticks(rows)
    tables = [_table(f"success{end}", f"Success, {scope}", "As the paper scores.", STEPS, groups, _success)]
    tables.append(
        _table(f"safety{end}", f"What the plant went through, {scope}", "By its true values.", _SAFETY, groups, _safety)
    )
    tables.append(
        _table(
            f"diagnosis{end}", f"Detection and diagnosis, {scope}",
            "Both come before any proposal; proposers differ where earlier actions changed what was seen.",
            _DIAGNOSIS, groups, _diagnosis,
        )
    )  # fmt: skip
    compared = [group for group in groups if group.proposer != HINDSIGHT]
    beside = {id(group): against(group.rows, known) for group in compared}
    shown = [group for group in compared if beside[id(group)].over_reaction or beside[id(group)].missed]
    if shown:
        tables.append(
            _table(
                f"yardsticks{end}", f"Beside what was possible, {scope}",
                "Against runs on the same plant with the same faults: by hindsight, and with nobody acting.",
                _YARDSTICKS, shown, lambda g: _against(beside[id(g)]),
            )
        )  # fmt: skip
    asked = [group for group in groups if effort_of(group.rows).asked or effort_of(group.rows).failures]
    if asked:
        note = "Over the runs in which a model was asked."
        tables.append(_table(f"effort{end}", f"Questions to language models, {scope}", note, _EFFORT, asked, _effort))
    return tables


def _table(
    name: str, title: str, note: str, scores: Sequence[Column], groups: Sequence[Group], cells: Callable[[Group], Cells]
) -> Table:
    """One line per group; the column of scenarios is left out where all are together."""
    apart = name.endswith("_by_scenario")
    columns = (_CASE, *((_SCENARIO,) if apart else ()), *WHO, _RUNS, *scores)
    lines = [
        (g.case, *((g.scenario,) if apart else ()), g.name, g.source.value, len(g.rows), *cells(g)) for g in groups
    ]
    return compact(Table(name, title, note, columns, tuple(lines)))


def _success(group: Group) -> Cells:
    s = success_of(group.rows)
    return s.success, s.recovery, s.plans, s.actions, s.precision, s.recall


def _safety(group: Group) -> Cells:
    s = safety_of(group.rows)
    return (
        s.none_outside, s.exposure, s.exposure_detected, s.margin, s.closest, s.loss, s.complete, s.delay, s.spilled,
    )  # fmt: skip


def _diagnosis(group: Group) -> Cells:
    d = diagnosis_of(group.rows)
    return d.detected, d.delay, d.false_alarms, d.right, d.truth, d.brier


def _against(beside: Against) -> Cells:
    return beside.over_reaction, beside.missed, beside.loss_regret, beside.time_regret


def _effort(group: Group) -> Cells:
    e = effort_of(group.rows)
    return e.asked, e.calls, e.read, e.written, e.cost, e.failures, e.counted_by


def _latency(group: Group) -> Cells:
    t = latency_of(group.rows)
    return t.decision, t.thinking, t.call, t.run
