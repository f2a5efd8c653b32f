"""What a report holds, in its order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.evaluate.report.groups import in_order
from homeostat.evaluate.report.tables.paper import paper_latency, paper_tables
from homeostat.evaluate.report.tables.runs import actor_table, calibration_table, comparison_table, failure_table
from homeostat.evaluate.report.tables.scores import agent_table, latency_table, scenario_tables, score_tables
from homeostat.evaluate.report.tables.table import Table, distinct
from homeostat.evaluate.study.row import Row


@dataclass(frozen=True, slots=True)
class Contents:
    """The tables of a campaign. Only those of ``times`` depend on the machine that it ran on."""

    main: tuple[Table, ...]
    """Beside the published figures, and over all scenarios of a case."""
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

    Args:
        reference: name of the proposer that others are compared with; by default the first in order.
    """
    ordered = in_order(rows)
    main = [
        *paper_tables(ordered), *score_tables(ordered), comparison_table(ordered, reference), actor_table(ordered),
        agent_table(ordered),
    ]  # fmt: skip
    times = [*paper_latency(ordered), latency_table(ordered)]
    details = [*scenario_tables(ordered), calibration_table(ordered)]
    parts = [[table for table in part if table.lines] for part in (main, times, details)]
    named = iter(distinct([*(table for part in parts for table in part), failure_table(ordered)]))
    main_kept, times_kept, details_kept = (tuple(next(named) for _ in part) for part in parts)
    return Contents(main_kept, times_kept, details_kept, next(named))
