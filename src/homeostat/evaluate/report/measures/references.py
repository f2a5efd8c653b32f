"""A run beside what was possible on the same plant with the same faults: by hindsight, and if nobody had acted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from homeostat.evaluate.report.groups import in_order, succeeded
from homeostat.evaluate.report.statistics import Rate, Spread, rate, spread
from homeostat.evaluate.study.row import DO_NOTHING, HINDSIGHT, WHOLE, Row

Pair = tuple[str, str, int]
"""What rows have in common that are the same plant with the same faults: case, scenario, seed."""


@dataclass(frozen=True, slots=True)
class Yardsticks:
    """What was possible -> the row that shows it."""

    hindsight: dict[Pair, Row]
    """The best that an exhaustive search on the true plant found."""
    idle: dict[Pair, Row]
    """What happened where nobody acted."""


@dataclass(frozen=True, slots=True)
class Against:
    """One group beside the yardsticks."""

    over_reaction: Rate | None
    """Runs that acted, among those that needed no action: without any, they succeed inside every hard limit."""
    missed: Rate | None
    """Runs that did not succeed, among those in which success was possible by hindsight."""
    loss_regret: Spread | None
    """Production loss beyond the best by hindsight [1]; continuous plants."""
    time_regret: Spread | None
    """Completion later than the best by hindsight [s]; batches that were completed."""


def yardsticks(rows: Iterable[Row]) -> Yardsticks:
    """The rows that show what was possible; where there are several for a pair, the first in order."""
    shown: dict[str, dict[Pair, Row]] = {HINDSIGHT: {}, DO_NOTHING: {}}
    for row in in_order(row for row in rows if row.proposer in (HINDSIGHT, DO_NOTHING)):
        if row.ablation == WHOLE:
            shown[row.proposer].setdefault(row.pair, row)
    return Yardsticks(shown[HINDSIGHT], shown[DO_NOTHING])


def against(rows: Sequence[Row], known: Yardsticks) -> Against:
    """One group beside what is ``known`` to have been possible."""
    needless = [row for row in rows if (idle := known.idle.get(row.pair)) is not None and _is_harmless(idle)]
    best = [(row, known.hindsight[row.pair]) for row in rows if row.pair in known.hindsight]
    return Against(
        over_reaction=rate([row.acted for row in needless]),
        missed=rate([not succeeded(row) for row, possible in best if succeeded(possible)]),
        loss_regret=spread(
            [
                row.production_loss - possible.production_loss
                for row, possible in best
                if not row.batch and row.production_loss is not None and possible.production_loss is not None
            ]
        ),
        time_regret=spread(
            [
                row.complete_s - possible.complete_s
                for row, possible in best
                if row.batch and row.complete_s is not None and possible.complete_s is not None
            ]
        ),
    )


def _is_harmless(idle: Row) -> bool:
    """Whether nothing had to be done: without any action the plant succeeded and never left a hard limit."""
    return idle.success and idle.exposure_s <= 0.0
