"""Tokens that every agent read and wrote."""

from collections.abc import Callable, Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from homeostat.evaluate.report.figures.picture import INK, Picture, lined, picture, short
from homeostat.evaluate.report.groups import Group, Origin, overall
from homeostat.evaluate.report.measures import Tokens, tokens_of
from homeostat.evaluate.report.statistics import Spread
from homeostat.record.row import AGENTS, Row

_FILL: Final = {"planning": "#4c78a8", "action": "#f2a65a", "reprompting": "#8f6bb3"}
_BAR: Final = 0.26
"""Height of a bar, as part of a proposer's line [1]."""

Asked = list[tuple[Group, list[Tokens]]]
"""Groups that asked a language model, with what each agent asked."""


def token_bars(plant: str, rows: Sequence[Row]) -> Picture | None:
    """Bars of one plant; None where no language model was asked."""
    asked = [(group, tokens) for group in overall(rows) if (tokens := tokens_of(group.rows))]
    if not asked:
        return None

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, sharey=True)
        _bars(left, asked, lambda tokens: tokens.read)
        _bars(right, asked, lambda tokens: tokens.written)
        left.set_xlabel("tokens of its questions")
        right.set_xlabel("tokens of the answers")
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=len(AGENTS))

    caption = "Bar: median over the runs in which a model was asked; line: up to the worst run."
    return picture(f"Tokens per agent and run: {plant}", caption, (8.6, 0.9 + 0.62 * len(asked)), draw)


def _bars(axis: Axes, asked: Asked, of: Callable[[Tokens], Spread]) -> None:
    for number, agent in enumerate(AGENTS):
        lines = [(line, of(t)) for line, (_, tokens) in enumerate(asked) for t in tokens if t.agent == agent]
        heights = [line + (number - (len(AGENTS) - 1) / 2) * _BAR for line, _ in lines]
        if lines:
            axis.barh(heights, [s.median for _, s in lines], 0.9 * _BAR, color=_FILL[agent], label=agent)
            axis.hlines(heights, [s.median for _, s in lines], [s.worst for _, s in lines], color=INK, linewidth=0.9)
    lined(axis, [_label(group) for group, _ in asked])
    axis.set_xlim(left=0.0)


def _label(group: Group) -> str:
    """The proposer, and on a second line that no model was asked, where none was."""
    plain = group.source in (Origin.MEASURED, Origin.REFERENCE)
    return short(group.name) + ("" if plain else f"\n({group.source.value})")
