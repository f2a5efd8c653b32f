"""Every run as a dot, with the quartiles over them: no mean hides a bad run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from homeostat.evaluate.report.figures.picture import (
    BAD,
    INK,
    QUIET,
    Picture,
    colours,
    lined,
    picture,
    plain,
    short,
    small,
)
from homeostat.evaluate.report.groups import Group, overall, succeeded
from homeostat.evaluate.report.statistics import quantile
from homeostat.record.row import Row

_LINE: Final = 0.34
"""Height of a proposer's line [in]."""
_AXIS: Final = 0.55
"""Height of an axis with its name [in]."""
_SPREAD: Final = 0.5
"""Part of a line over which its dots lie [1]."""
_GOLDEN: Final = 0.618034
"""Step from one dot to the next; the golden ratio never comes back to the same height."""
_WIDE: Final = 8.6
"""Width of a figure [in]."""


@dataclass(frozen=True, slots=True)
class Measure:
    """What one panel shows."""

    name: str
    """Name of the axis, with the unit."""
    of: Callable[[Row], float | None]
    """The value of a run; None where it has none."""
    logarithmic: bool = False
    """Whether the axis is logarithmic above 1."""


PROCESS: Final = (
    Measure("true time outside a hard limit [s]", lambda row: row.exposure_s, True),
    Measure("least margin to a hard limit, in scales [1]", lambda row: row.least_margin),
    Measure("production loss [%]", lambda row: None if row.production_loss is None else 100.0 * row.production_loss),
    Measure("delay of completed batches [s]", lambda row: row.delay_s),
    Measure("from onset to the first report [s]", lambda row: row.detection_s, True),
)
TIMES: Final = (
    Measure("thinking until the first action [s]", lambda row: row.wall_decision_s, True),
    Measure("mean time of an answer, per run [s]", lambda row: row.wall_call_s),
)


def strips(title: str, rows: Sequence[Row], measures: Sequence[Measure]) -> Picture | None:
    """One panel per measure; None where no run has any. Proposers without values are left out of a panel."""
    groups = overall(rows)
    panels = [(m, here) for m in measures if (here := [g for g in groups if _values(g.rows, m)])]
    if not panels:
        return None
    heights = [_LINE * (1.2 + max(len(here) for _, here in panels[i : i + 2])) for i in range(0, len(panels), 2)]

    def draw(figure: Figure) -> None:
        grid = figure.add_gridspec(len(heights), 2, height_ratios=heights)
        for number, (measure, here) in enumerate(panels):
            alone = number == len(panels) - 1 and number % 2 == 0
            place = grid[number // 2, :] if alone else grid[number // 2, number % 2]
            _panel(figure.add_subplot(place), measure, here, colours(rows))

    caption = (
        "One dot per run; a red cross is a run that did not succeed. Bar: first to third quartile; tick: median. "
        "Numbers: runs that have the value; of these, those at 0 where the axis is logarithmic above 1."
    )
    return picture(title, caption, (_WIDE, sum(heights) + _AXIS * len(heights)), draw)


def _panel(axis: Axes, measure: Measure, groups: Sequence[Group], colour: dict[str, str]) -> None:
    if measure.logarithmic:
        axis.set_xscale("symlog", linthresh=1.0, linscale=0.4)
        axis.xaxis.set_major_formatter(plain)
    for line, group in enumerate(groups):
        values = [v for _, v in _values(group.rows, measure)]
        low, middle, high = (quantile(values, share) for share in (0.25, 0.5, 0.75))
        axis.plot([low, high], [line] * 2, color=colour[group.name], linewidth=7.0, alpha=0.3, solid_capstyle="butt")
        dots = _dots(group.rows, measure, line)
        for good, mark, size, edge, fill in ((True, ".", 4.5, 0.0, colour[group.name]), (False, "x", 3.6, 0.9, BAD)):
            chosen = [(value, height) for row, value, height in dots if succeeded(row) is good]
            x, y = [value for value, _ in chosen], [height for _, height in chosen]
            axis.plot(x, y, mark, color=fill, markersize=size, markeredgewidth=edge, alpha=0.65)
        axis.plot([middle] * 2, [line - 0.3, line + 0.3], color=INK, linewidth=1.6)
        none = sum(value == 0.0 for value in values)
        words = f"{len(values)}, {none} at 0" if measure.logarithmic and none else f"{len(values)}"
        small(axis, words, (1.0, line), ("axes fraction", "data"), (4, 0), va="center", color=QUIET)
    lined(axis, [short(group.name) for group in groups])
    axis.set_xlabel(measure.name)
    axis.spines["left"].set_visible(False)


def _dots(rows: Sequence[Row], measure: Measure, line: int) -> list[tuple[Row, float, float]]:
    """Runs with their values, and heights that spread them evenly over the line: no dot hides another."""
    return [
        (row, value, line + _SPREAD * ((i * _GOLDEN) % 1.0 - 0.5))
        for i, (row, value) in enumerate(_values(rows, measure))
    ]


def _values(rows: Sequence[Row], measure: Measure) -> list[tuple[Row, float]]:
    return [(row, value) for row in rows if (value := measure.of(row)) is not None]
