"""One panel of a run's picture: true and measured values, setpoints, commands and limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from homeostat.campaign.runner import RunResult
from homeostat.cases.case import Panel
from homeostat.domain.formula_ast import Comparison, Negate, Node, Number, TagValue, walk
from homeostat.domain.limits import Limit
from homeostat.domain.plant_description import PlantDescription
from homeostat.domain.tag import Role

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS: Final = ("#0072b2", "#009e73", "#e69f00", "#56b4e9", "#cc79a7")
"""Okabe and Ito's palette, which is told apart by colour-blind readers too, without its reds: red is for limits."""
_LIMIT: Final = "#c1121f"
_MARGIN: Final = 0.06
"""Free part of the axis above and below what is drawn [1]."""


def draw_panel(axis: Axes, panel: Panel, plant: PlantDescription, run: RunResult) -> None:
    """Draw the panel's tags and limits over the x axis that ``axis`` has already."""
    first_s, last_s = axis.get_xlim()
    times = run.truth.times_s
    shown = (times >= first_s) & (times <= last_s)
    low, high = panel.window
    quantities = list(dict.fromkeys(_quantity(tag) for tag in panel.tags))
    for tag in panel.tags:
        colour = _COLOURS[quantities.index(_quantity(tag)) % len(_COLOURS)]
        true, measured = run.truth.signals[tag][0], run.measured.signals[tag][0]
        match plant.tag(tag).role:
            case Role.SP:
                axis.plot(times, true, color=colour, linewidth=1.1, linestyle=(0, (5, 3)), label=tag, zorder=3)
            case Role.MV:
                axis.plot(times, true, color=colour, linewidth=1.1, linestyle=(0, (1, 1.6)), label=tag, zorder=3)
            case Role.PV | Role.STATUS:
                axis.plot(times, measured, color=colour, linewidth=0.7, alpha=0.28, zorder=1)
                axis.plot(times, true, color=colour, linewidth=1.7, label=tag, zorder=4)
        inside = true[shown & np.isfinite(true)]
        if inside.size:
            low, high = min(low, float(inside.min())), max(high, float(inside.max()))
    unit = plant.tag(panel.tags[0]).unit
    _draw_limits(axis, panel, plant, unit)
    spare = _MARGIN * (high - low)
    axis.set_ylim(low - spare, high + spare)
    axis.set_ylabel(f"{panel.title}\n[{'fraction' if unit == '1' else unit}]", fontsize=9)
    axis.tick_params(axis="both", labelsize=8.5, length=3)
    axis.grid(True, color="#e6e6e6", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(
        loc="center left", bbox_to_anchor=(1.004, 0.5), fontsize=8.5, frameon=False, handlelength=1.9, borderpad=0.0
    )


def _draw_limits(axis: Axes, panel: Panel, plant: PlantDescription, unit: str) -> None:
    """Limits as lines that say what they protect."""
    first_s, last_s = axis.get_xlim()
    for limit in plant.limits.limits:
        if limit.name not in panel.limits:
            continue
        for value, upper in _thresholds(limit, panel.tags):
            axis.axhline(value, color=_LIMIT, linewidth=1.2, zorder=2)
            words = f"{limit.description}, {value:g}{'' if unit == '1' else ' ' + unit}"
            axis.annotate(
                words, (last_s - 0.005 * (last_s - first_s), value), xytext=(0, 2 if upper else -2),
                textcoords="offset points", ha="right", va="bottom" if upper else "top", fontsize=8, color=_LIMIT,
                zorder=6,
            )  # fmt: skip


def _thresholds(limit: Limit, tags: tuple[str, ...]) -> list[tuple[float, bool]]:
    """Values that the limit compares one of ``tags`` with, and whether each is an upper limit."""
    found = []
    for node, _ in walk(limit.formula.root):
        if isinstance(node, Comparison):
            left, right = _number(node.left), _number(node.right)
            if isinstance(node.left, TagValue) and node.left.tag in tags and right is not None:
                found.append((right, node.operator in ("<=", "<")))
            elif isinstance(node.right, TagValue) and node.right.tag in tags and left is not None:
                found.append((left, node.operator in (">=", ">")))
    return found


def _number(node: Node) -> float | None:
    if isinstance(node, Negate):
        value = _number(node.operand)
        return None if value is None else -value
    return node.value if isinstance(node, Number) else None


def _quantity(tag: str) -> str:
    """What a tag and its setpoint or command have in common."""
    return tag.partition(".")[0]
