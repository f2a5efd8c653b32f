"""A run beside what was possible on the same plant with the same faults: by hindsight, and if nobody had acted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from homeostat.evaluate.report.groups import in_order, succeeded
from homeostat.evaluate.report.statistics import Rate, rate
from homeostat.evaluate.study.row import DO_NOTHING, HINDSIGHT, WHOLE, Row

Pair = tuple[str, str, int]
"""What rows have in common that are the same plant with the same faults: case, scenario, seed."""


@dataclass(frozen=True, slots=True)
class References:
    """Rows of the reference policies, by the pair that they belong to."""

    hindsight: dict[Pair, Row]
    """The best that an exhaustive search on the true plant found."""
    idle: dict[Pair, Row]
    """What happened where nobody acted."""

    @classmethod
    def among(cls, rows: Iterable[Row]) -> References:
        """The rows that show what was possible; where there are several for a pair, the first in order."""
        whole = [row for row in reversed(in_order(rows)) if row.ablation == WHOLE]
        hindsight, idle = ({r.pair: r for r in whole if r.proposer == who} for who in (HINDSIGHT, DO_NOTHING))
        return cls(hindsight, idle)

    def is_harmless(self, row: Row) -> bool:
        """Whether nothing had to be done: without any action the plant succeeded and never left a hard limit."""
        idle = self.idle.get(row.pair)
        return idle is not None and idle.success and idle.exposure_s <= 0.0

    def possible(self, row: Row) -> Row | None:
        """What hindsight shows of the same plant with the same faults."""
        return self.hindsight.get(row.pair)

    def missed(self, rows: Sequence[Row]) -> Rate | None:
        """Runs that did not succeed, among those in which success was possible by hindsight."""
        return rate([not succeeded(row) for row in rows if (best := self.possible(row)) and succeeded(best)])
