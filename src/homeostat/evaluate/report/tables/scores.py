"""The scores of a group of runs: what the paper scores, what the plant went through, what was believed, what it took.

No cell where nothing can be said: nobody was asked, or nothing of the kind happened.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Final

from homeostat.evaluate.report.groups import Group, succeeded
from homeostat.evaluate.report.measures.diagnosis import is_right
from homeostat.evaluate.report.measures.references import References
from homeostat.evaluate.report.measures.usage import Usage, asked
from homeostat.evaluate.report.statistics import Spread, spread
from homeostat.evaluate.report.tables.score import Score, Value, count, mean, middle, part, share
from homeostat.evaluate.report.tables.table import Column, Kind
from homeostat.evaluate.study.row import Row

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
    return *_SAFETY, *map(_total, sorted({name for row in rows for name in row.totals}))


def _total(name: str) -> Score[Group]:
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
