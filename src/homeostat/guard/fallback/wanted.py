"""Wanted: by when recovery must have acted, and the alarm in place of a fallback where a person has the say."""

from collections.abc import Callable, Iterable

from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import Armed
from homeostat.domain.request import Answer, RequestStatus
from homeostat.guard.fallback.fallback import Fallbacks
from homeostat.guard.texts import brief
from homeostat.guard.watch.alarms import Alarms

WANTED = "fallback wanted"
"""Identifier of the alarm."""
BETTER = frozenset({RequestStatus.OFFERED, RequestStatus.ADVISED, RequestStatus.ACCEPTED})
"""What is said of a request that passed every check."""


class Wanted:
    """Holds the alarm while a limit is violated, or recovery wishes for the fallback and has nothing better."""

    def __init__(self, alarms: Alarms) -> None:
        """Nobody wants anything yet."""
        self._alarms = alarms
        self._wished = False

    def call(self, reason: str, now_s: float) -> None:
        """A fallback is wanted, and nobody may write."""
        self._alarms.raise_(WANTED, reason, Priority.CRITICAL, now_s)

    def wish(self, reason: str, by_s: float | None, now_s: float) -> None:
        """Recovery gives up, for ``reason``; ``by_s``: by when physics wants something to be done, if at all [s]."""
        self._wished = True
        left = "" if by_s is None else f"; physics leaves time until {by_s:.0f} s"
        self.call(f"{brief(reason)}{left}", now_s)

    def hear(self, answers: Iterable[Answer]) -> None:
        """Recovery has something better where one of the ``answers`` of a tick says that a request passed."""
        if any(answer.status in BETTER for answer in answers):
            self._wished = False

    def drop(self) -> None:
        """Nobody need be asked any more."""
        self._wished = False

    def follow(self, violated: bool, latched: bool, now_s: float) -> None:
        """It ends where a fallback acts, or where no limit is ``violated`` and nobody wishes for one any more."""
        self._wished = self._wished and not latched
        if latched or not (violated or self._wished):
            self._alarms.return_(WANTED, now_s)


class TimeToAct:
    """Holds the time at which the first fallback acts by itself."""

    def __init__(self, note: Callable[[Armed, float], None], fallbacks: Callable[[], Fallbacks]) -> None:
        """``note`` journals at a process time [s] how the ``fallbacks`` are ranked, and by when the first one acts."""
        self._note, self._fallbacks = note, fallbacks
        self.by_s: float | None = None
        """Process time by which recovery must have acted [s]; None for no such time."""

    def remember(self, by_s: float | None) -> None:
        """Go on after a death: ``by_s`` is what the journal says last [s]."""
        self.by_s = by_s

    def arm(self, by_s: float | None, now_s: float, anew: bool = False) -> None:
        """Recovery has ranked the fallbacks, and must have acted by ``by_s`` or by a time that stood before [s].

        ``anew``: a time that stood before counts no more, unless it has come already.
        """
        standing_s = None if anew and not self.has_passed(now_s) else self.by_s
        self._set(min((t for t in (by_s, standing_s) if t is not None), default=None), now_s)

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

    def tell(self, now_s: float) -> None:
        """Journal how the fallbacks are ranked, for a reason that no other event tells a restart."""
        fallbacks = self._fallbacks()
        names = tuple(strategy.name for strategy in fallbacks.ranked)
        self._note(Armed(names, self.by_s, bool(fallbacks.armed)), now_s)

    def _set(self, by_s: float | None, now_s: float) -> None:
        self.by_s = by_s
        self.tell(now_s)
