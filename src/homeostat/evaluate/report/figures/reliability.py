"""How often a diagnosis is true, by its probability."""

from collections.abc import Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from homeostat.evaluate.report.figures.picture import QUIET, Picture, colours, picture, short, small
from homeostat.evaluate.report.groups import Group, Origin, overall, plants
from homeostat.evaluate.report.measures import Bin, reliability
from homeostat.record.row import Row

_SIDE: Final = 3.6
"""Width of a plant's panel [in]."""


def reliability_plot(rows: Sequence[Row]) -> Picture | None:
    """One panel per plant; None where nothing was diagnosed."""
    panels = [(plant, shown) for plant in plants(rows) if (shown := _curves([r for r in rows if r.case == plant]))]
    if not panels:
        return None

    def draw(figure: Figure) -> None:
        axes = figure.subplots(1, len(panels), squeeze=False)[0]
        for axis, (plant, shown) in zip(axes, panels, strict=True):
            _panel(axis, short(plant), shown, colours(rows))
        axes[0].set_ylabel("how often it was true")

    caption = (
        "Below the dashed line the diagnosis is too sure of itself, above it too careful. Dots with 95 % Wilson "
        "intervals and the number of diagnoses: the first proposer; faint lines: the others, whose diagnoses are "
        "mostly the same, because they come before any proposal."
    )
    size = (max(2, len(panels)) * _SIDE, _SIDE)
    return picture("What a probability of the diagnosis is worth", caption, size, draw)


def _curves(rows: Sequence[Row]) -> list[tuple[Group, list[Bin]]]:
    """Bins of every proposer that diagnosed anything; reference policies only where nobody else did."""
    found = [(group, bins) for group in overall(rows) if (bins := reliability(group.rows))]
    return [one for one in found if one[0].source is not Origin.REFERENCE] or found


def _panel(axis: Axes, title: str, shown: Sequence[tuple[Group, list[Bin]]], colour: dict[str, str]) -> None:
    axis.plot([0.0, 1.0], [0.0, 1.0], linestyle=(0, (4, 3)), color=QUIET, linewidth=1.0)
    for group, bins in shown[1:]:
        x, y = [b.believed for b in bins], [b.right.share for b in bins]
        axis.plot(x, y, color=colour[group.name], linewidth=0.9, alpha=0.35)
    group, bins = shown[0]
    main = colour[group.name]
    axis.plot([b.believed for b in bins], [b.right.share for b in bins], "o-", color=main, linewidth=1.5, markersize=5)
    for one in bins:
        ends = one.right.interval
        if ends is not None:
            axis.plot([one.believed] * 2, [ends.low, ends.high], color=main, linewidth=1.0)
        small(axis, f"{one.right.of}", (one.believed, 0.0), ("data", "axes fraction"), (0, 3), ha="center", color=main)
    axis.set_xlim(0.0, 1.02)
    axis.set_ylim(-0.1, 1.04)
    axis.set_title(f"{title}: {short(group.name)}")
    axis.set_xlabel("probability of what was believed most")
    axis.grid()
