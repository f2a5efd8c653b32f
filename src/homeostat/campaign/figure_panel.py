"""One panel of a run's picture: true and measured values, setpoints, commands and limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from homeostat.campaign.runner import RunResult
from homeostat.cases.case import Panel
from homeostat.domain.formula import Formula
from homeostat.domain.formula_ast import Comparison, Negate, Node, Number, Or, TagValue, walk
from homeostat.domain.formula_text import render
from homeostat.domain.limits import Limit
from homeostat.domain.plant_description import PlantDescription
from homeostat.domain.snapshot import Trajectory
from homeostat.domain.tag import Role

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS: Final = ("#0072b2", "#009e73", "#e69f00", "#56b4e9", "#cc79a7")
"""Okabe and Ito's palette, which is told apart by colour-blind readers too, without its reds: red is for limits."""
_DASHES: Final = {Role.SP: (0, (5, 3)), Role.MV: (0, (1, 1.6))}
"""Lines of setpoints and commands; process values and positions are solid."""
_LIMIT: Final = "#c1121f"
_MARGIN: Final = 0.06
"""Free part of the axis above and below what is drawn [1]."""


def draw_panel(axis: Axes, panel: Panel, plant: PlantDescription, run: RunResult, started_s: float) -> None:
    """Draw the panel's tags and limits over the x axis that ``axis`` has already.

    From ``started_s`` [s], when the plant left start-up, limits are in force and everything drawn is inside the axis.
    """
    times = run.truth.times_s
    shown = times >= max(axis.get_xlim()[0], started_s)
    low, high = panel.window
    quantities = list(dict.fromkeys(_quantity(tag) for tag in panel.tags))
    for tag in panel.tags:
        rank = quantities.index(_quantity(tag))
        colour, width = _COLOURS[rank % len(_COLOURS)], max(2.3 - 0.6 * rank, 1.1)
        true, measured = run.truth.signals[tag][0], run.measured.signals[tag][0]
        dashes = _DASHES.get(plant.tag(tag).role)
        if dashes is None:
            axis.plot(times, measured, color=colour, linewidth=0.7, alpha=0.28, zorder=1)
            axis.plot(times, true, color=colour, linewidth=width, label=tag, zorder=4)
        else:
            axis.plot(times, true, color=colour, linewidth=1.1, linestyle=dashes, label=tag, zorder=5)
        inside = true[shown & np.isfinite(true)]
        if inside.size:
            low, high = min(low, float(inside.min())), max(high, float(inside.max()))
    unit = plant.tag(panel.tags[0]).unit
    _draw_limits(axis, panel, plant, run.truth, started_s)
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


def _draw_limits(axis: Axes, panel: Panel, plant: PlantDescription, truth: Trajectory, started_s: float) -> None:
    """Limits as lines that say what they protect; pale while they are not in force."""
    first_s, last_s = axis.get_xlim()
    unit = plant.tag(panel.tags[0]).unit
    for limit in plant.limits.limits:
        if limit.name not in panel.limits:
            continue
        for threshold in thresholds(limit, panel.tags):
            value, upper = threshold.value, threshold.upper
            axis.axhline(value, color=_LIMIT, linewidth=1.0, alpha=0.3, zorder=2)
            binding = in_force(limit, threshold.node, truth) & (truth.times_s > started_s)
            line = np.where(binding, value, np.nan)
            axis.plot(truth.times_s, line, color=_LIMIT, linewidth=1.3, zorder=2)
            words = f"{limit.description}, {value:g}{'' if unit == '1' else ' ' + unit}"
            axis.annotate(
                words, (last_s - 0.005 * (last_s - first_s), value), xytext=(0, 2 if upper else -2),
                textcoords="offset points", ha="right", va="bottom" if upper else "top", fontsize=8, color=_LIMIT,
                zorder=6,
            )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Threshold:
    """A value that a limit compares a drawn tag with."""

    node: Comparison
    """The comparison."""
    value: float
    """The value, in the tag's unit."""
    upper: bool
    """Whether the tag must stay below it."""


def thresholds(limit: Limit, tags: tuple[str, ...]) -> list[Threshold]:
    """What the limit compares one of ``tags`` with."""
    found = []
    for node, _ in walk(limit.formula.root):
        if isinstance(node, Comparison):
            left, right = _number(node.left), _number(node.right)
            if isinstance(node.left, TagValue) and node.left.tag in tags and right is not None:
                found.append(Threshold(node, right, node.operator in ("<=", "<")))
            elif isinstance(node.right, TagValue) and node.right.tag in tags and left is not None:
                found.append(Threshold(node, left, node.operator in (">=", ">")))
    return found


def in_force(limit: Limit, comparison: Comparison, truth: Trajectory) -> NDArray[np.bool_]:
    """When the comparison must hold, shape (times,): always, or while no alternative of an ``or`` does."""
    root = limit.formula.root
    others = [o for o in root.operands if o != comparison] if isinstance(root, Or) else []
    lifted = np.zeros(truth.length, dtype=np.bool_)
    for other in others:
        lifted |= Formula(render(other), other).margins(truth.signals, truth.dt_s)[0] >= 0.0
    return ~lifted


def _number(node: Node) -> float | None:
    if isinstance(node, Negate):
        value = _number(node.operand)
        return None if value is None else -value
    return node.value if isinstance(node, Number) else None


def _quantity(tag: str) -> str:
    """What a tag and its setpoint or command have in common."""
    return tag.partition(".")[0]
