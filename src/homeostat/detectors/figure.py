"""What was found in a table as a picture: the detectors against their limit, and the signals that depart most."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Final

import numpy as np

from homeostat.detectors.watching import Course

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIGNALS: Final = 4
"""Most signals that are drawn."""
_WIDTH: Final = 11.0
_SCORES: Final = 2.4
_SIGNAL: Final = 1.25
"""Width of the picture, heights of its panels [in]."""
_COLOURS: Final = ("#0072B2", "#E69F00", "#009E73", "#56B4E9", "#CC79A7", "#F0E442", "#000000")
"""Okabe and Ito's palette without its red, which is for limits."""
_LIMIT: Final = "#D55E00"
_LOW: Final = 0.05
"""Least score that is drawn [1]."""


def draw(course: Course) -> bytes:
    """The picture as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shown = shown_signals(course)
    heights = [_SCORES, *[_SIGNAL] * len(shown)]
    figure = Figure(figsize=(_WIDTH, sum(heights) + 1.2), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0].tolist()
    _draw_scores(axes[0], course)
    for axis, name in zip(axes[1:], shown, strict=True):
        axis.plot(course.table.times, course.table.of([name]).values[:, 0], color="#333333", linewidth=0.7)
        axis.set_ylabel(_short(name), fontsize=8)
    for axis in axes:
        _mark(axis, course)
    table = course.table
    since = f" since {table.told(0)}" if table.start else ""
    axes[-1].set_xlabel(f"Time{since} [s]" if table.timed else "Row", fontsize=9)
    found = f"{len(course.alarms)} alarms, {course.share:.1%} of {len(table) - course.healthy} rows beyond the limit"
    figure.suptitle(f"{_short(table.name, 80)}: {found}", fontsize=11, fontweight="bold", x=0.01, ha="left")
    content = BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None})
    return content.getvalue()


def shown_signals(course: Course) -> tuple[str, ...]:
    """The signals that alarms name, most often first; without an alarm those that depart most."""
    weights = dict.fromkeys(course.table.signals, 0.0)
    for alarm in course.alarms:
        for name, departure in alarm.signals:
            weights[name] += alarm.rows * departure
    if not course.alarms:
        weights = dict(zip(weights, course.judged.signals[course.healthy :].max(axis=0).tolist(), strict=True))
    ranked = sorted(weights, key=lambda name: -weights[name])
    return tuple(name for name in ranked[:SIGNALS] if weights[name] > 0.0)


def _draw_scores(axis: Axes, course: Course) -> None:
    for column, name in enumerate(course.names):
        scores = np.maximum(course.judged.scores[:, column], _LOW)
        axis.plot(course.table.times, scores, linewidth=0.8, color=_COLOURS[column % len(_COLOURS)], label=name)
    axis.axhline(1.0, color=_LIMIT, linewidth=1.2, label="limit")
    axis.set_yscale("log")
    axis.set_ylabel("score [limit]", fontsize=9)
    axis.legend(fontsize=8, ncols=len(course.names) + 1, loc="upper left", frameon=False)


def _mark(axis: Axes, course: Course) -> None:
    """Shade what it was judged by, and the alarms."""
    times = course.table.times
    if course.healthy:
        axis.axvspan(times[0], times[course.healthy - 1], color="#009E73", alpha=0.08, linewidth=0)
    for alarm in course.alarms:
        axis.axvspan(times[alarm.first], times[alarm.last], color=_LIMIT, alpha=0.15, linewidth=0)
    axis.grid(True, color="#e6e6e6", linewidth=0.6)
    axis.tick_params(labelsize=8)
    axis.margins(x=0.01)


def _short(text: str, most: int = 24) -> str:
    """``text`` without what a picture takes for a formula, and not too long."""
    plain = text.replace("$", "")
    return plain if len(plain) <= most else f"...{plain[-most:]}"
