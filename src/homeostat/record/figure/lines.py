"""One panel of a run's picture: true and measured values, setpoints, commands and limits."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.tag import Role
from homeostat.record.figure.limits import draw_guards, draw_limits
from homeostat.record.figure.panel import LinePanel, Panel
from homeostat.record.figure.shown import ShownRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS: Final = (
    "#0072b2", "#009e73", "#e69f00", "#56b4e9", "#cc79a7", "#332288", "#999933", "#117733", "#44aa99", "#aa8866"
)  # fmt: skip
"""Okabe and Ito's palette, which is told apart by colour-blind readers too, without its reds: red is for limits.

Behind it what is left of Tol's: of many signals of one panel no two have the same colour.
"""
_DASHES: Final = {Role.SP: (0, (5, 3)), Role.MV: (0, (1, 1.6))}
"""Lines of setpoints and commands; process values and positions are solid."""
_TICKS: Final = 6
"""Intervals of the y axis, at most."""
_TITLE: Final = 22
"""Characters that fit beside the height of a panel."""
_MARGIN: Final = 0.06
"""Free part of the axis above and below what is drawn [1]."""


def draw_lines(axis: Axes, panel: LinePanel, plant: PlantDescription, run: ShownRun, started_s: float) -> None:
    """Draw the panel's tags and limits over the x axis that ``axis`` has already.

    From ``started_s`` [s], when the plant left start-up, limits are in force and every true value is inside the axis.
    """
    times = run.truth.times_s
    first_s, last_s = axis.get_xlim()
    shown = (times >= max(first_s, started_s)) & (times <= last_s)
    low, high = panel.window
    quantities = list(dict.fromkeys(_quantity(tag, panel.tags, plant) for tag in panel.tags))
    for tag in panel.tags:
        rank = quantities.index(_quantity(tag, panel.tags, plant))
        colour, width = _COLOURS[rank % len(_COLOURS)], max(2.3 - 0.6 * rank, 1.1)
        true, measured = run.truth.signals[tag][0], run.measured.signals[tag][0]
        dashes = _DASHES.get(plant.tag(tag).role)
        if dashes is None:
            axis.plot(times, measured, color=colour, linewidth=0.8, alpha=0.42, zorder=1)
            axis.plot(times, true, color=colour, linewidth=width, label=tag, zorder=4)
        else:
            axis.plot(times, true, color=colour, linewidth=1.1, linestyle=dashes, label=tag, zorder=5)
        inside = true[shown & np.isfinite(true)]
        if inside.size:
            low, high = min(low, float(inside.min())), max(high, float(inside.max()))
    spare = _MARGIN * (high - low)
    axis.set_ylim(low - spare, high + spare)
    draw_limits(axis, panel, plant, run.truth, started_s)
    draw_guards(axis, panel, plant, run.truth)
    axis.locator_params(axis="y", nbins=_TICKS)
    name_axis(axis, panel)
    axis.grid(True, color="#e6e6e6", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.legend(
        loc="center left", bbox_to_anchor=(1.004, 0.5), fontsize=8.5, frameon=False, handlelength=1.9, borderpad=0.0
    )


def name_axis(axis: Axes, panel: Panel) -> None:
    """What the panel shows and in which unit, beside its y axis."""
    title = "\n".join(textwrap.wrap(panel.title, _TITLE, max_lines=2, placeholder=" ..."))
    axis.set_ylabel(f"{title}\n[{'fraction' if panel.unit == '1' else panel.unit}]", fontsize=9)
    axis.tick_params(axis="both", labelsize=8.5, length=3)
    axis.spines[["top", "right"]].set_visible(False)


def _quantity(tag: str, beside: Sequence[str], plant: PlantDescription) -> str:
    """What is drawn in one colour: a reading with its setpoint or command, and no other reading."""
    if plant.tag(tag).role not in _DASHES:
        return tag
    name = tag.rpartition(".")[0]
    solid = [each for each in beside if plant.tag(each).role not in _DASHES]
    return next((each for each in solid if each == name or each.rpartition(".")[0] == name), name)
