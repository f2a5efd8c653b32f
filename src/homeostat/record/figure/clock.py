"""How the times of a picture are told: in seconds, or in hours where what is shown lasts for hours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, final

from homeostat.domain.plant.timing import Timing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HOUR_S: Final = 3_600.0
FEWEST_HOURS: Final = 6.0
"""What is shown for so long is told in hours [h]."""
_INTERVALS: Final = 9
"""Intervals of the time axis, at most."""
_ROUND: Final = (1, 2, 3, 4, 6, 8, 10)
"""What the intervals are multiples of, by powers of ten [h]."""


@final
class Clock:
    """Tells the process times of one picture."""

    def __init__(self, shown: tuple[float, float], timing: Timing) -> None:
        """``shown``: first and last time [s]; ``timing``: that of the plant."""
        self._shown, self._timing = shown, timing
        self._hours = shown[1] - shown[0] >= FEWEST_HOURS * HOUR_S
        self.unit = "h" if self._hours else "s"
        """Unit of what is told."""

    def number(self, at_s: float) -> str:
        """A time without its unit."""
        return f"{at_s / HOUR_S:.2f}" if self._hours else self._timing.told(at_s)

    def told(self, at_s: float) -> str:
        """A time with its unit."""
        return f"{self.number(at_s)} {self.unit}"

    def mark(self, axis: Axes) -> None:
        """Let the time axis of ``axis`` have this unit; what is drawn stays in seconds."""
        axis.set_xlabel(f"Process time [{self.unit}]", fontsize=9.5)
        if not self._hours:
            return
        from matplotlib.ticker import MaxNLocator

        first, last = (at_s / HOUR_S for at_s in self._shown)
        hours = [h for h in MaxNLocator(_INTERVALS, steps=_ROUND).tick_values(first, last) if first <= h <= last]
        axis.set_xticks([h * HOUR_S for h in hours], [f"{h:g}" for h in hours])
