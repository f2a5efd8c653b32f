"""The moments of a run as lines through every panel, explained in a strip above them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from homeostat.domain.plant.state_machine import StateMachine
from homeostat.record.figure.clock import Clock
from homeostat.record.figure.shown import GroundTruth, ShownRun
from homeostat.record.releases import Release

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

_ONSET: Final = "#3a3a3a"
_DETECTED: Final = "#b8860b"
_RELEASED: Final = "#00755a"
_FALLBACK: Final = "#6a3d9a"
_COMPLETE: Final = "#5f6b76"
_CROWDED: Final = 4.0
"""Room between the times of later releases below which the second one's is left out [pixel]."""
MOST_BEGINNINGS = 3
"""Most beginnings of faults and disturbances that are marked one by one."""


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


def strip_rows(marks: Sequence[Mark], run: ShownRun) -> int:
    """Lines of text above the panels: one per mark, one for silence, one for later releases."""
    return len(marks) + _quiet(run) + (len(run.record.releases) > 1)


def draw_marks(strip: Axes, panels: Sequence[Axes], marks: Sequence[Mark], run: ShownRun, clock: Clock) -> None:
    """Draw every moment; later releases are thin lines with their times."""
    total = strip_rows(marks, run)
    strip.set_ylim(0.0, total)
    strip.axis("off")
    first_s, _ = strip.get_xlim()
    if _quiet(run):
        strip.text(first_s, total - 0.5, "Nothing detected, nothing released.", fontsize=9, color=_ONSET, va="center")
    for row, mark in enumerate(marks, start=_quiet(run)):
        for axis in panels:
            axis.axvline(mark.at_s, color=mark.colour, linewidth=1.3, linestyle=mark.dashes, zorder=5)
        height = total - 0.5 - row
        strip.plot([mark.at_s] * 2, [0.0, height], color=mark.colour, linewidth=1.0, linestyle=mark.dashes)
        _write(strip, mark.words, mark.at_s, height, 9.0, mark.colour)
    later = [m for m in run.record.releases[1:] if m.at_s >= first_s]
    for moment in later:
        for axis in panels:
            axis.axvline(moment.at_s, color=_RELEASED, linewidth=0.6, alpha=0.7, zorder=2)
    _write_times(strip, later, clock)


def _quiet(run: ShownRun) -> bool:
    """Whether nothing was detected and nothing was done."""
    return not (run.record.diagnosed or run.record.releases or run.record.fallbacks)


def _write_times(strip: Axes, later: Sequence[Release], clock: Clock) -> None:
    """Times of later releases on the lowest line, where there is room."""
    last: Text | None = None
    for moment in later:
        words = clock.number(moment.at_s) if last is not None else f"released {clock.told(moment.at_s)}"
        text = _write(strip, words, moment.at_s, 0.4, 7.5, _RELEASED)
        if last is not None and text.get_window_extent().overlaps(last.get_window_extent().padded(_CROWDED)):
            text.remove()
        else:
            last = text


def _write(strip: Axes, words: str, at_s: float, height: float, size: float, colour: str) -> Text:
    """Words to the right of a moment, or to the left of it where the right has no room."""
    text = strip.annotate(
        words,
        (at_s, height),
        xytext=(4, 0),
        textcoords="offset points",
        va="center",
        fontsize=size,
        color=colour,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        zorder=6,
    )
    if text.get_window_extent().x1 > strip.figure.bbox.x1:
        text.set(x=-4, ha="right")
    return text


def explained(run: ShownRun, machine: StateMachine, clock: Clock) -> list[Mark]:
    """Onset, detection, first release, first fallback and completion, as far as they happened, in order of time."""
    onset = run.scenario.onset_s
    labels = {state.name: state.label for state in machine.states}
    marks = []
    for at_s, what in _beginnings(run.scenario):
        marks.append(Mark(at_s, f"{what} begins, {_begun(at_s, clock)}", _ONSET, (0, (2, 2))))
    if run.detected_s is not None:
        marks.append(Mark(run.detected_s, f"detected{_when(run.detected_s, onset, clock)}", _DETECTED, "solid"))
    if run.record.releases:
        first = run.record.releases[0]
        words = f"released{_when(first.at_s, onset, clock)}, to reach {labels.get(first.target, first.target)!r}"
        marks.append(Mark(first.at_s, words, _RELEASED, "solid"))
    if run.record.fallbacks:
        at_s, acted = run.record.fallbacks[0]
        marks.append(
            Mark(at_s, f"fallback {acted.strategy!r} activated{_when(at_s, onset, clock)}", _FALLBACK, "solid")
        )
    if run.complete_s is not None:
        nominal = f" (without the fault {clock.told(run.nominal_s)})" if onset is not None and run.nominal_s else ""
        reached = [state for state, at_s in run.record.states if at_s <= run.complete_s][-1]
        marks.append(
            Mark(run.complete_s, f"{labels[reached]}, {clock.told(run.complete_s)}{nominal}", _COMPLETE, "solid")
        )
    return sorted(marks, key=lambda mark: mark.at_s)


def _beginnings(scenario: GroundTruth) -> list[tuple[float, str]]:
    """When faults and disturbances begin, in order of time; of many, the first, and how many more there are."""
    found: dict[float, list[str]] = {}
    each = [*((f.onset_s, f.fault) for f in scenario.faults), *((d.from_s, d.what) for d in scenario.disturbances)]
    for at_s, what in sorted(each, key=lambda one: one[0]):
        found.setdefault(at_s, []).append(what)
    marked = [(at_s, "+".join(names)) for at_s, names in found.items()]
    if len(marked) > MOST_BEGINNINGS:
        first, what = marked[0]
        return [(first, f"{what}, and {len(marked) - 1} more later,")]
    return marked


def _begun(at_s: float, clock: Clock) -> str:
    """When something begins, which need not be at a tick."""
    return f"{at_s:g} s" if clock.unit == "s" else clock.told(at_s)


def _when(at_s: float, onset_s: float | None, clock: Clock) -> str:
    if onset_s is None or at_s < onset_s:
        return f", {clock.told(at_s)}"
    return f" after {clock.told(at_s - onset_s)}, at {clock.told(at_s)}"
