"""Tokens that every agent read and wrote."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from homeostat.evaluate.report.figures.svg import INK, Picture, as_svg, look, short
from homeostat.evaluate.report.groups import Group, Source, overall
from homeostat.evaluate.report.measures.scores import AGENTS, Tokens, effort_of
from homeostat.evaluate.report.statistics import Spread
from homeostat.evaluate.study.row import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FILL: Final = {"planning": "#4c78a8", "action": "#f2a65a", "reprompting": "#8f6bb3"}
_BAR: Final = 0.26
"""Height of a bar, as part of a proposer's line [1]."""

Asked = list[tuple[Group, dict[str, Tokens]]]
"""Groups that asked a language model, with what each agent asked."""


def token_bars(case: str, rows: Sequence[Row], name: str) -> Picture | None:
    """Bars of one case; None where no language model was asked."""
    asked = [(group, {t.agent: t for t in effort_of(group.rows).agents}) for group in overall(rows)]
    asked = [(group, agents) for group, agents in asked if agents]
    if not asked:
        return None
    from matplotlib.figure import Figure

    title = f"Tokens per agent and run: {case}"
    with look(name):
        figure = Figure(figsize=(8.6, 0.9 + 0.62 * len(asked)), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        _bars(left, asked, [{a: t.read for a, t in agents.items()} for _, agents in asked])
        _bars(right, asked, [{a: t.written for a, t in agents.items()} for _, agents in asked])
        left.set_xlabel("tokens of its questions")
        right.set_xlabel("tokens of the answers")
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=len(AGENTS))
        svg = as_svg(figure, name, title)
    caption = "Bar: median over the runs in which a model was asked; line: up to the worst run."
    return Picture(title, caption, svg)


def _bars(axis: Axes, asked: Asked, spreads: Sequence[dict[str, Spread]]) -> None:
    for number, agent in enumerate(AGENTS):
        lines = [(line, found[agent]) for line, found in enumerate(spreads) if agent in found]
        heights = [line + (number - (len(AGENTS) - 1) / 2) * _BAR for line, _ in lines]
        if lines:
            axis.barh(heights, [s.median for _, s in lines], 0.9 * _BAR, color=_FILL[agent], label=agent)
            axis.hlines(heights, [s.median for _, s in lines], [s.worst for _, s in lines], color=INK, linewidth=0.9)
    labels = [_label(group) for group, _ in asked]
    axis.set_yticks(range(len(asked)), labels)
    axis.set_ylim(len(asked) - 0.4, -0.6)
    axis.set_xlim(left=0.0)
    axis.tick_params(axis="y", length=0)
    axis.grid(axis="x", color="#e6e9ed", linewidth=0.6)
    axis.set_axisbelow(True)


def _label(group: Group) -> str:
    """The proposer, and on a second line that no model was asked, where none was."""
    plain = group.source in (Source.MEASURED, Source.YARDSTICK)
    return short(group.name) + ("" if plain else f"\n({group.source.value})")
