"""Modes: who may write."""

from __future__ import annotations

from homeostat.domain.mode import Mode
from homeostat.guard.writing.tenure import Tenure


class Modes:
    """Holds the plant's mode; the lease is held in modes that write, and by a fallback until it stands."""

    def __init__(self, tenure: Tenure) -> None:
        """Everything begins in observe."""
        self._tenure = tenure
        self._wanted: Mode | None = None
        self.mode = Mode.OBSERVE
        """The mode."""

    def enter(self, mode: Mode, now_s: float) -> str:
        """Go over to ``mode``; why not, or empty. Where it does not write, :meth:`settle` gives the lease back.

        One that writes takes the lease also where it seems to be held: it may have been lost without a word.
        """
        objection, self._wanted = self._tenure.take(now_s) if mode.writes else "", None
        if not objection:
            self.mode = mode
        return objection

    def begin(self, mode: Mode, now_s: float) -> str:
        """Begin in ``mode``; why not, or empty. Where the lease is under way, :meth:`late` enters it later."""
        objection = self.enter(mode, now_s)
        self._wanted = mode if objection and self._tenure.awaited else None
        return objection

    def late(self, now_s: float) -> Mode | None:
        """The mode that it was to begin in, where that is entered now, because the lease has come."""
        wanted = self._wanted if self._tenure.arrived else None
        return wanted if wanted is not None and not self.enter(wanted, now_s) else None

    def settle(self, now_s: float, sending: bool) -> None:
        """Give the lease back in a mode that does not write, unless a fallback is still being sent (``sending``)."""
        if not self.mode.writes and not sending:
            self._tenure.give_back(now_s)
