"""Success by scenario and proposer, as in the paper's heat map."""

from collections.abc import Mapping, Sequence
from typing import Final

from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from homeostat.evaluate.report.figures.picture import INK, QUIET, Picture, picture, short
from homeostat.evaluate.report.groups import arms, by_scenario, scenarios, succeeded
from homeostat.record.row import Row

_CELL: Final = (0.95, 0.36)
"""Width and height of a cell [in]."""
_DARK: Final = 0.25
"""Distance from the middle of the scale beyond which a cell is so dark that its words are white [1]."""
_GAP: Final = 0.25
"""Between two blocks of columns [cell]."""

Counts = Mapping[tuple[str, str], tuple[int, int]]
"""Line and column -> successes and runs."""


def heat_map(plant: str, rows: Sequence[Row]) -> Picture:
    """The heat map of one plant; ``rows`` are its own and not empty."""
    caption = "Runs that succeeded, of those made; empty where there was none."
    return success_map(f"Success by scenario: {plant}", caption, scenarios(rows), [arms(rows)], counts(rows))


def counts(rows: Sequence[Row]) -> Counts:
    """Scenario and proposer -> successes and runs."""
    groups = by_scenario(rows)
    return {(g.scenario, g.name): (sum(succeeded(row) for row in g.rows), len(g.rows)) for g in groups}


def success_map(
    title: str, caption: str, lines: Sequence[str], blocks: Sequence[Sequence[str]], counted: Counts
) -> Picture:
    """A cell for each line and column, whose ``blocks`` stand apart."""
    places: dict[str, float] = {}
    for apart, block in enumerate(block for block in blocks if block):
        places |= {name: len(places) + i + _GAP * apart for i, name in enumerate(block)}
    width = max(places.values()) + 1.0

    def draw(figure: Figure) -> None:
        axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        scale = colormaps["RdBu"]
        for row, line in enumerate(lines):
            for column, place in places.items():
                good, of = counted.get((line, column), (0, 0))
                face = scale(0.12 + 0.76 * good / of) if of else "none"
                axis.add_patch(Rectangle((place, row), 0.97, 0.94, facecolor=face, edgecolor="#d0d7de", linewidth=0.5))
                if of:
                    colour = "white" if abs(good / of - 0.5) > _DARK else INK
                    axis.text(place + 0.485, row + 0.49, f"{good}/{of}", color=colour, ha="center", va="center")
        for block in filter(None, blocks[1:]):
            axis.axvline(places[block[0]] - _GAP / 2, color=QUIET, linewidth=0.8)
        axis.set_xlim(0.0, width)
        axis.set_ylim(len(lines), 0.0)
        axis.xaxis.tick_top()
        middles = [place + 0.4 for place in places.values()]
        axis.set_xticks(middles, [short(name) for name in places], rotation=35, ha="left", fontsize=8.5)
        axis.set_yticks([i + 0.49 for i in range(len(lines))], [short(line) for line in lines])
        axis.tick_params(length=0)
        axis.spines[:].set_visible(False)

    return picture(title, caption, (width * _CELL[0], len(lines) * _CELL[1]), draw, layout=None)
