"""The heat map of a study with the published columns of the same faults on the right."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.paper.published import published_lines
from homeostat.evaluate.report.figures.heat_map import Counts, counts, success_map
from homeostat.evaluate.report.figures.picture import Picture
from homeostat.evaluate.report.groups import arms, scenarios
from homeostat.record.row import Row

MARKS = {"paper": "published", "rerun": "rerun"}


def heat_map(plant: str, rows: Sequence[Row]) -> Picture:
    """The heat map of one plant; ``rows`` are its own and not empty."""
    theirs = published_counts(plant, rows)
    caption = "Runs that succeeded, of those made; empty where there was none. Right: published, of the same fault."
    columns = [arms(rows), list(dict.fromkeys(column for _, column in theirs))]
    return success_map(f"Success by scenario: {plant}", caption, scenarios(rows), columns, {**counts(rows), **theirs})


def published_counts(plant: str, rows: Sequence[Row]) -> Counts:
    """Published counts of the scenarios that stand for a published row: the paper's columns first."""
    found = [
        (line.source, line.model, scenario, (line.successes, line.runs))
        for scenario, row in sorted({(row.scenario, row.published) for row in rows if row.published})
        for line in published_lines(plant, row)
    ]
    return {(scenario, f"{model}, {MARKS[source]}"): counted for source, model, scenario, counted in sorted(found)}
