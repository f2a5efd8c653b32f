"""Wanted: the alarm in place of a fallback that nothing has act, as a person has the say or nobody may write."""

from __future__ import annotations

from collections.abc import Iterable

from homeostat.domain.alarm import Priority
from homeostat.domain.request import Answer, RequestStatus
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
