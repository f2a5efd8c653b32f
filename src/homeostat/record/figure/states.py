"""The supervisory states of a run over time: one row per state in the order of entry, named beside its bars."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from homeostat.domain.plant.state_machine import StateMachine
from homeostat.record.run_record import RunRecord

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RISK: Final = ("#bfd9c2", "#b5cfea", "#f3dc9f", "#efc191", "#e39c8d", "#cf7f80")
"""Bars of the states by their risk, calm ones first."""
_HEIGHT: Final = 0.8
"""Height of a bar, as part of its row [1]."""
_GAP: Final = 0.006
"""Room between a bar and its name, as part of the width [1]."""
_FALLBACK: Final = "Safe state (fallback)"


@dataclass(frozen=True, slots=True)
class StateRow:
    """One state and when the plant was in it."""

    label: str
    """In the operator's words."""
    risk: int
    """Rank of undesirability; 0 is normal operation."""
    bars: tuple[tuple[float, float], ...]
    """Begin and end of every stay, in order of time [s]."""


def rows(machine: StateMachine, record: RunRecord, first_s: float, last_s: float) -> list[StateRow]:
    """States that the plant was in between ``first_s`` and ``last_s`` [s], in order of entry."""
    known = {state.name: state for state in machine.states}
    entered = [(0.0, machine.initial.name), *((at_s, state) for state, at_s in record.states)]
    # A fallback that the machine answers with a state of its own is named by that state.
    answered = {at_s for _, at_s in record.states}
    entered += [(at_s, _FALLBACK) for at_s, _ in record.fallbacks if at_s not in answered]
    entered.sort(key=lambda entry: entry[0])
    stays: dict[str, list[tuple[float, float]]] = {}
    for (begin, name), (end, _) in pairwise([*entered, (last_s, "")]):
        left, right = max(begin, first_s), min(end, last_s)
        if right <= left:
            continue
        bars = stays.setdefault(name, [])
        if bars and bars[-1][1] == left:
            left = bars.pop()[0]
        bars.append((left, right))
    worst = len(_RISK) - 1
    return [
        StateRow(known[name].label, known[name].risk, tuple(bars))
        if name in known
        else StateRow(name, worst, tuple(bars))
        for name, bars in stays.items()
    ]


def draw_states(axis: Axes, states: Sequence[StateRow]) -> None:
    """Draw the rows from the top; every name stands where its row is free."""
    for number, row in enumerate(states):
        widths = [(begin, end - begin) for begin, end in row.bars]
        colour = _RISK[min(row.risk, len(_RISK) - 1)]
        axis.broken_barh(
            widths, (number - _HEIGHT / 2, _HEIGHT), facecolor=colour, edgecolor="#6f6f6f", linewidth=0.5, zorder=6
        )
        _name(axis, number, row)
    axis.set_ylim(len(states) - 0.5, -0.5)
    axis.set_yticks([])
    axis.set_ylabel("State", fontsize=9)
    axis.spines[["top", "right"]].set_visible(False)
    axis.grid(True, axis="x", color="#e6e6e6", linewidth=0.6)
    axis.set_axisbelow(True)


def _name(axis: Axes, number: int, row: StateRow) -> None:
    """Write the name into the longest bar, or else beside a bar, into the longest free stretch of the row."""
    first_s, last_s = axis.get_xlim()
    gap_s = _GAP * (last_s - first_s)
    text = axis.text(first_s, number, row.label, fontsize=8.5, color="#202020", va="center", zorder=7)
    box = text.get_window_extent().transformed(axis.transData.inverted())
    begin, end = max(row.bars, key=lambda bar: bar[1] - bar[0])
    if end - begin > box.width + 2 * gap_s:
        text.set(x=(begin + end) / 2, ha="center")
        return
    edges = [first_s, *(at_s for bar in row.bars for at_s in bar), last_s]
    left, right = max(zip(edges[::2], edges[1::2], strict=True), key=lambda free: free[1] - free[0])
    if left > first_s:
        text.set(x=left + gap_s, ha="left")
    else:
        text.set(x=right - gap_s, ha="right")
    text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.4})
