"""Discrete signals of a run's picture: one row per tag, a bar while it is open or on, as high as its value."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from homeostat.domain.snapshot import Trajectory
from homeostat.record.figure.lines import name_axis
from homeostat.record.figure.panel import StripPanel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BAR: Final = "#2a78b0"
_LANE: Final = "#f1f3f5"
_FULL: Final = 0.76
"""Height of a bar at the upper end of the range, as part of its row [1]."""


def draw_strips(axis: Axes, panel: StripPanel, truth: Trajectory) -> None:
    """Draw the rows from the top; a value is the one since the sample before it."""
    for row, tag in enumerate(panel.tags):
        foot = row + _FULL / 2
        axis.axhspan(foot - _FULL, foot, color=_LANE, linewidth=0, zorder=0)
        values = truth.signals[tag][0]
        # A tag on automatic has no value of its own.
        filled = np.clip(np.nan_to_num((values - panel.range.low) / panel.range.span), 0.0, 1.0)
        axis.fill_between(truth.times_s, foot, foot - _FULL * filled, step="pre", color=_BAR, linewidth=0, zorder=3)
    axis.set_ylim(len(panel.tags) - 0.5, -0.5)
    axis.set_yticks(range(len(panel.tags)), panel.tags)
    name_axis(axis, panel)
    axis.tick_params(axis="y", length=0)
    axis.grid(True, axis="x", color="#e6e6e6", linewidth=0.6)
    axis.set_axisbelow(True)
