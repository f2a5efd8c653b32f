"""Limits and the ends of steps as lines that say what they are for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Limit
from homeostat.domain.snapshot import Trajectory
from homeostat.record.figure.panel import LinePanel
from homeostat.stl.formula import Formula
from homeostat.stl.text import render
from homeostat.stl.tree import Binary, Call, Comparison, Negate, Node, Number, Or, TagValue, walk

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Bbox

Curves: TypeAlias = list[tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Times [s] and values of what is drawn."""

_LIMIT: Final = "#c1121f"
_GUARD: Final = "#6b6b6b"
_PLACES: Final = tuple(1.0 - 0.05 * n for n in range(17))
"""Where the words at a line may end, as part of the width [1]; the right end is preferred."""


def draw_limits(axis: Axes, panel: LinePanel, plant: PlantDescription, truth: Trajectory, started_s: float) -> None:
    """Limits in red, pale while they are not in force; limits of one value share a line and its words."""
    told: dict[tuple[float, bool], list[str]] = {}
    written: list[Bbox] = []
    for limit in plant.limits.limits:
        if limit.name not in panel.limits:
            continue
        for threshold in thresholds(limit.formula, panel.tags):
            binding = in_force(limit, threshold.node, truth) & (truth.times_s > started_s)
            axis.plot(truth.times_s, np.where(binding, threshold.value, np.nan), color=_LIMIT, linewidth=1.3, zorder=2)
            told.setdefault((threshold.value, threshold.upper), []).append(limit.description)
    for (value, upper), descriptions in told.items():
        axis.axhline(value, color=_LIMIT, linewidth=1.0, alpha=0.35, zorder=2)
        words = f"{together(descriptions)}, {_amount(value, panel.unit)}"
        _annotate(axis, value, words, upper, _LIMIT, (_curves(panel, truth), written))


def draw_guards(axis: Axes, panel: LinePanel, plant: PlantDescription, truth: Trajectory) -> None:
    """Where a step ends: what the guards of the panel's transitions compare its tags with."""
    guards = [t.guard for t in plant.machine.transitions if t.name in panel.guards]
    found = [threshold for guard in guards for threshold in thresholds(guard, panel.tags)]
    for value, upper in dict.fromkeys((t.value, t.upper) for t in found):
        axis.axhline(value, color=_GUARD, linewidth=0.8, linestyle=(0, (6, 2, 1, 2)), alpha=0.8, zorder=2)
        _annotate(axis, value, f"step ends, {_amount(value, panel.unit)}", upper, _GUARD, (_curves(panel, truth), []))


def together(descriptions: Sequence[str]) -> str:
    """Several descriptions as one: those that differ in a single word are told once, with every such word."""
    rows = [text.split() for text in dict.fromkeys(descriptions)]
    if len({len(row) for row in rows}) == 1:
        columns = [list(dict.fromkeys(words)) for words in zip(*rows, strict=True)]
        if sum(len(words) > 1 for words in columns) <= 1:
            return " ".join("/".join(words) for words in columns)
    return "; ".join(" ".join(row) for row in rows)


def _annotate(axis: Axes, value: float, words: str, above: bool, colour: str, drawn: tuple[Curves, list[Bbox]]) -> None:
    """Words at a line, where they cover least of what is ``drawn``: curves, and words that are written already."""
    from matplotlib.patheffects import withStroke

    curves, written = drawn
    text = axis.annotate(
        words,
        (1.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(-4, 0),
        textcoords="offset points",
        ha="right",
        fontsize=8,
        color=colour,
        zorder=6,
        path_effects=[withStroke(linewidth=2.0, foreground="white")],
    )

    def put(place: float, side: bool) -> None:
        text.xy = (place, value)
        text.xyann = (-4, 1.5 if side else -2)
        text.set_verticalalignment("bottom" if side else "top")

    def covered(where: tuple[float, bool]) -> tuple[int, int]:
        put(*where)
        extent = text.get_window_extent()
        box = extent.transformed(axis.transData.inverted())
        left, right = box.x0, box.x1
        if left < axis.get_xlim()[0]:
            return len(written), sum(values.size for _, values in curves)
        low, high = sorted((box.y0, box.y1))
        points = sum(
            int(np.count_nonzero((times >= left) & (times <= right) & (values >= low) & (values <= high)))
            for times, values in curves
        )
        return sum(extent.overlaps(other) for other in written), points

    put(*min([(place, side) for side in (above, not above) for place in _PLACES], key=covered))
    written.append(text.get_window_extent())


def _curves(panel: LinePanel, truth: Trajectory) -> Curves:
    return [(truth.times_s, truth.signals[tag][0]) for tag in panel.tags]


def _amount(value: float, unit: str) -> str:
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"


@dataclass(frozen=True, slots=True)
class Threshold:
    """A value that a limit compares a drawn tag with."""

    node: Comparison
    """The comparison."""
    value: float
    """The value, in the tag's unit."""
    upper: bool
    """Whether the tag must stay below it."""


def thresholds(formula: Formula, tags: Sequence[str]) -> list[Threshold]:
    """What the formula compares one of ``tags`` with."""
    found = []
    for node, _ in walk(formula.root):
        if isinstance(node, Comparison):
            left, right = _number(node.left), _number(node.right)
            if right is not None:
                found += _sides(node, node.left, right, node.operator in ("<=", "<"), tags)
            elif left is not None:
                found += _sides(node, node.right, left, node.operator in (">=", ">"), tags)
    return found


def _sides(node: Comparison, of: Node, value: float, upper: bool, tags: Sequence[str]) -> list[Threshold]:
    """The value where a tag of ``tags`` is compared with it; both sides where its distance from a number is."""
    if isinstance(of, TagValue) and of.tag in tags:
        return [Threshold(node, value, upper)]
    if not (isinstance(of, Call) and of.function == "abs"):
        return []
    (inner,), middle = of.arguments, 0.0
    if isinstance(inner, Binary) and inner.operator == "-" and (number := _number(inner.right)) is not None:
        inner, middle = inner.left, number
    if not (isinstance(inner, TagValue) and inner.tag in tags):
        return []
    return [Threshold(node, middle + value, upper), Threshold(node, middle - value, not upper)]


def in_force(limit: Limit, comparison: Comparison, truth: Trajectory) -> NDArray[np.bool_]:
    """When the comparison must hold, shape (times,): always, or while no alternative of an ``or`` does.

    Another instrument that is held to the same value is no alternative, nor are several of them that are believed
    together: which of them reads decides what is known, and not what must hold.
    """
    root = limit.formula.root
    others = (
        [o for o in root.operands if o != comparison and not _holds_to_it(o, comparison)]
        if isinstance(root, Or)
        else []
    )
    lifted = np.zeros(truth.length, dtype=np.bool_)
    for other in others:
        lifted |= Formula(render(other), other).margins(truth.signals, truth.dt_s)[0] >= 0.0
    return ~lifted


def _holds_to_it(alternative: Node, comparison: Comparison) -> bool:
    """Whether ``alternative`` is the comparison, or holds another reading to the same value, at least among others."""
    compared = [node for node, _ in walk(alternative) if isinstance(node, Comparison)]
    return any(_bound(node) == _bound(comparison) is not None for node in compared)


def _bound(node: Comparison) -> tuple[str, float] | None:
    """Side and number of a comparison of a reading with a number; None of any other."""
    left, right = _number(node.left), _number(node.right)
    if right is not None and isinstance(node.left, TagValue):
        return node.operator[0], right
    if left is not None and isinstance(node.right, TagValue):
        return {"<": ">", ">": "<"}[node.operator[0]], left
    return None


def _number(node: Node) -> float | None:
    if isinstance(node, Negate):
        value = _number(node.operand)
        return None if value is None else -value
    return node.value if isinstance(node, Number) else None
