"""TimeToAct: by when recovery must have acted; once it is said it only comes nearer, until something ends it."""

from __future__ import annotations

from collections.abc import Callable

from homeostat.domain.events.guard import Armed


class TimeToAct:
    """Holds the time at which the first fallback acts by itself."""

    def __init__(self, note: Callable[[Armed, float], None], ranked: Callable[[], tuple[str, ...]]) -> None:
        """``note`` journals at a process time [s]; ``ranked`` gives the fallbacks, the one that acts first in front."""
        self._note, self._ranked = note, ranked
        self.by_s: float | None = None
        """Process time by which recovery must have acted [s]; None for no such time."""

    def arm(self, by_s: float | None, now_s: float) -> None:
        """Recovery has ranked the fallbacks, and must have acted by ``by_s`` or by a time that stood before [s]."""
        self._set(min((t for t in (by_s, self.by_s) if t is not None), default=None), now_s)

    def end(self, now_s: float) -> None:
        """Nothing need act by itself any more, for a reason that no other event tells a restart."""
        if self.by_s is not None:
            self._set(None, now_s)

    def over(self) -> None:
        """A request was confirmed or a fallback acts, and the journal says so."""
        self.by_s = None

    def has_passed(self, now_s: float) -> bool:
        """Whether it is time to act."""
        return self.by_s is not None and now_s >= self.by_s

    def _set(self, by_s: float | None, now_s: float) -> None:
        self.by_s = by_s
        self._note(Armed(self._ranked(), by_s), now_s)
