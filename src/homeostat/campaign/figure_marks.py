"""The moments of a run as lines through every panel, explained in a strip above them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from homeostat.campaign.milestones import Milestones
from homeostat.campaign.runner import RunResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROWS: Final = 4
"""Lines of text that fit into the strip."""
_TURN: Final = 0.7
"""Part of the width from which on a text stands to the left of its mark."""
_ONSET: Final = "#3a3a3a"
_NOTICED: Final = "#b8860b"
_RELEASED: Final = "#00755a"
_FALLBACK: Final = "#6a3d9a"


@dataclass(frozen=True, slots=True)
class Mark:
    """One moment that is explained in words."""

    at_s: float
    """Process time [s]."""
    words: str
    """What happened."""
    colour: str
    """Colour of line and words."""
    dashes: tuple[float, tuple[float, ...]] | str
    """Style of the line."""


def draw_marks(strip: Axes, panels: Sequence[Axes], run: RunResult, milestones: Milestones) -> None:
    """Draw every moment; later releases are thin lines with their times."""
    strip.set_ylim(0.0, _ROWS)
    strip.axis("off")
    first_s, last_s = strip.get_xlim()
    marks = explained(run, milestones)
    if not marks:
        strip.text(first_s, 1.0, "Nothing was reported and nothing was done.", fontsize=9, color=_ONSET, va="center")
    for row, mark in enumerate(marks):
        for axis in panels:
            axis.axvline(mark.at_s, color=mark.colour, linewidth=1.3, linestyle=mark.dashes, zorder=5)
        height = _ROWS - 0.5 - row % _ROWS
        strip.plot([mark.at_s] * 2, [0.0, height], color=mark.colour, linewidth=1.0, linestyle=mark.dashes)
        left = (mark.at_s - first_s) / (last_s - first_s) > _TURN
        strip.annotate(
            mark.words, (mark.at_s, height), xytext=(-4 if left else 4, 0), textcoords="offset points",
            ha="right" if left else "left", va="center", fontsize=9, color=mark.colour,
        )  # fmt: skip
    later = [m for m in milestones.releases[1:] if m.at_s >= first_s]
    for number, moment in enumerate(later):
        for axis in panels:
            axis.axvline(moment.at_s, color=_RELEASED, linewidth=0.6, alpha=0.7, zorder=2)
        words = f"adjusted {moment.at_s:.0f} s" if number == 0 else f"{moment.at_s:.0f}"
        crowded = number > 0 and moment.at_s - later[number - 1].at_s < 0.045 * (last_s - first_s)
        if not crowded:
            strip.annotate(
                words, (moment.at_s, 0.0), xytext=(2, 3), textcoords="offset points", fontsize=7.5, color=_RELEASED,
                va="bottom",
            )  # fmt: skip


def explained(run: RunResult, milestones: Milestones) -> list[Mark]:
    """Onset, detection, first release and first fallback, as far as they happened, in order of time."""
    onset = run.scenario.onset_s
    marks = []
    if onset is not None:
        marks.append(Mark(onset, f"{run.scenario.fault} begins, {onset:g} s", _ONSET, (0, (2, 2))))
    if run.detected_s is not None:
        marks.append(Mark(run.detected_s, f"noticed{_when(run.detected_s, onset)}", _NOTICED, "solid"))
    if milestones.releases:
        first = milestones.releases[0]
        words = f"actions released{_when(first.at_s, onset)}, to {first.what!r}"
        marks.append(Mark(first.at_s, words, _RELEASED, "solid"))
    if milestones.fallbacks:
        first = milestones.fallbacks[0]
        marks.append(Mark(first.at_s, f"fallback {first.what!r} acts{_when(first.at_s, onset)}", _FALLBACK, "solid"))
    return sorted(marks, key=lambda mark: mark.at_s)


def _when(at_s: float, onset_s: float | None) -> str:
    if onset_s is None or at_s < onset_s:
        return f", {at_s:.0f} s"
    return f" after {at_s - onset_s:.0f} s, at {at_s:.0f} s"
