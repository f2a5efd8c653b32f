"""The figure of the study: how often statements are right, by their probability, one panel per plant."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.unknown.judge import LEAST_COUNT, Bin

BLUE = "#0072B2"
"""A colour that colour-blind readers can tell from grey."""


def draw(panels: Mapping[str, Sequence[Bin]], path: Path) -> None:
    """Write the figure as PNG to ``path``."""
    figure = Figure(figsize=(4.8 * max(len(panels), 1), 4.4), layout="constrained")
    axes = figure.subplots(1, max(len(panels), 1), squeeze=False)[0]
    for axis, (title, bins) in zip(axes, panels.items(), strict=False):
        _panel(axis, title, bins)
    axes[0].set_ylabel("share that is right")
    figure.savefig(path, dpi=150)


def _panel(axis: Axes, title: str, bins: Sequence[Bin]) -> None:
    axis.plot([0.0, 1.0], [0.0, 1.0], ls="--", color="0.6", lw=1)
    filled = [b for b in bins if b.count]
    axis.plot([b.said for b in filled], [b.right for b in filled], "-", color=BLUE)
    for b in filled:
        enough = b.count >= LEAST_COUNT
        axis.plot([b.said], [b.right], "o", color=BLUE, mfc=BLUE if enough else "none")
        half = 1.96 * math.sqrt(b.right * (1.0 - b.right) / b.count)
        axis.plot([b.said] * 2, [max(b.right - half, 0.0), min(b.right + half, 1.0)], color=BLUE, lw=1)
        axis.annotate(str(b.count), (b.said, 0.0), xytext=(0, 3), textcoords="offset points", fontsize=7.5, ha="center")
    axis.set(title=title, xlabel="probability that is stated", xlim=(0, 1.02), ylim=(-0.06, 1.04))
    axis.grid(True, alpha=0.3)
