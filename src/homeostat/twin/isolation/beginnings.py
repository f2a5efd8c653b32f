"""Beginnings: readings that begin about where something known did say neither what was before it nor what is since.

Their first ones say what state the plant begins in. A step that a fault made among them is a state from which nothing
explains the rest, and the fault does not: a thermometer that began to read 10 K high four readings after the first is
taken for one that reads 6 K high, and then for a jacket that cools less.
"""

from collections.abc import Iterable, Sequence

from homeostat.twin.carried import FaultSet
from homeostat.twin.history import Window

ABOUT = 5
"""Readings by which the onset of what is known may be off."""


def begins_in(window: Window, known: Sequence[FaultSet]) -> bool:
    """Whether anything ``known`` began about where ``window`` does."""
    about_s = (window.settle_rows + ABOUT) * window.tick_s
    return any(abs(f.onset_s - window.start_s) <= about_s for faults in known for f in faults)


def before_onsets(start_s: float, onsets_s: Iterable[float], settle_rows: int, tick_s: float) -> float:
    """Where readings should begin that would from ``start_s`` on: earlier where something began about then [s].

    All that speaks for what began is seen again then. ``settle_rows``: first readings that say what state they begin
    in.
    """
    about_s = (settle_rows + ABOUT) * tick_s
    for onset_s in sorted(onsets_s, reverse=True):
        if abs(onset_s - start_s) <= about_s:
            start_s = onset_s - about_s - tick_s
    return start_s
