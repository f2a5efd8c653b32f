"""Success by scenario and proposer, as in the paper's heat map, with its own columns beside ours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from homeostat.evaluate.report.figures.svg import INK, QUIET, Picture, as_svg, look, short
from homeostat.evaluate.report.groups import Source, by_scenario, entrants, scenarios
from homeostat.evaluate.report.measures.scores import success_of
from homeostat.evaluate.report.tables.published import published_lines
from homeostat.evaluate.study.row import Row

_CELL: Final = (0.95, 0.36)
"""Width and height of a cell [in]."""
_DARK: Final = 0.25
"""Distance from the middle of the scale beyond which a cell is so dark that its words are white [1]."""

Counts = tuple[int, int]
"""Successes and runs."""


def heat_map(case: str, rows: Sequence[Row], name: str) -> Picture:
    """The heat map of one case; ``rows`` are its own and not empty."""
    ours, theirs = _ours(rows), _theirs(case, rows)
    own = entrants(rows)
    columns = [*own, *dict.fromkeys(column for _, column in theirs)]
    lines = scenarios(rows)
    return Picture(
        f"Success by scenario: {case}",
        "Runs that succeeded, of those made; empty where there was none. "
        + ("Columns on the right: published figures of the same fault." if theirs else ""),
        _draw(lines, columns, len(own), {**ours, **theirs}, name, f"Success rates of {case} by scenario and proposer"),
    )


def _draw(
    lines: Sequence[str],
    columns: Sequence[str],
    own: int,
    counts: dict[tuple[str, str], Counts],
    name: str,
    spoken: str,
) -> str:
    from matplotlib import colormaps
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    with look(name):
        gap = 0.25
        figure = Figure(figsize=((len(columns) + gap) * _CELL[0], len(lines) * _CELL[1]))
        axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        scale = colormaps["RdBu"]
        places = [i + gap * (i >= own) for i in range(len(columns))]
        for row, line in enumerate(lines):
            for place, column in zip(places, columns, strict=True):
                found = counts.get((line, column))
                share = None if found is None else found[0] / found[1]
                face = "none" if share is None else scale(0.12 + 0.76 * share)
                axis.add_patch(Rectangle((place, row), 0.97, 0.94, facecolor=face, edgecolor="#d0d7de", linewidth=0.5))
                if found is not None and share is not None:
                    colour = "white" if abs(share - 0.5) > _DARK else INK
                    axis.text(
                        place + 0.485, row + 0.49, f"{found[0]}/{found[1]}", color=colour, ha="center", va="center"
                    )
        if own < len(columns):
            axis.axvline(own + gap / 2, color=QUIET, linewidth=0.8)
        axis.set_xlim(0.0, len(columns) + gap * (own < len(columns)))
        axis.set_ylim(len(lines), 0.0)
        axis.xaxis.tick_top()
        axis.set_xticks([p + 0.4 for p in places], [short(c) for c in columns], rotation=35, ha="left", fontsize=8.5)
        axis.set_yticks([i + 0.49 for i in range(len(lines))], [short(line) for line in lines])
        axis.tick_params(length=0)
        axis.spines[:].set_visible(False)
        return as_svg(figure, name, spoken)


def _ours(rows: Sequence[Row]) -> dict[tuple[str, str], Counts]:
    counts = {}
    for group in by_scenario(rows):
        success = success_of(group.rows).success
        counts[group.scenario, group.name] = (success.count, success.of)
    return counts


def _theirs(case: str, rows: Sequence[Row]) -> dict[tuple[str, str], Counts]:
    """Published counts of the scenarios that stand for a published row: the paper's columns first."""
    found = []
    for scenario, row in sorted({(row.scenario, row.published) for row in rows if row.published}):
        for line in published_lines(case, row):
            mark = "published" if line.origin is Source.PAPER else "rerun"
            found.append((line.source, line.model, scenario, f"{line.model}, {mark}", (line.successes, line.runs)))
    return {(scenario, column): counts for _, _, scenario, column, counts in sorted(found)}
