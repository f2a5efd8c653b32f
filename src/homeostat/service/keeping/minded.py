"""A process that is started again when it dies or says nothing, after waits that double where it does not last."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import final

from homeostat.service.keeping.child import Child, ended


@dataclass(frozen=True, slots=True)
class Patience:
    """How long a process may say nothing, and how soon it is begun again."""

    start_s: float
    """Longest time from its begin to its first word, wall-clock [s]."""
    quiet_s: float
    """Longest time between two words, wall-clock [s]."""
    again_s: float
    """Wait before it is begun again after it has died at once; it doubles each time, wall-clock [s]."""
    most_s: float
    """Longest such wait, wall-clock [s]."""
    lasts_s: float = 60.0
    """After it has gone on for so long its next death is its first, and it is begun again at once [s]."""


@final
class Minded:
    """Minds one process."""

    def __init__(
        self, name: str, work: Callable[[int], int], patience: Patience, tell: Callable[[str], object]
    ) -> None:
        """``work`` is done in the process; ``tell`` is told each time that it ends or is begun again."""
        self._name, self._work, self._patience, self._tell = name, work, patience, tell
        self._deaths, self._due = 0, time.monotonic()
        self.child: Child | None = None
        """The process; None while there is none."""
        self.status: int | None = None
        """How the last one ended; None while none has."""

    def look(self) -> bool:
        """Begin, end or mind it, as it is time to; whether it has said that it goes on since the last look."""
        now = time.monotonic()
        if self.child is None:
            if now >= self._due:
                self._begin()
            return False
        said = self.child.listen()
        status = self.child.status
        if status is not None:
            self._gone(status, ended(status))
            return False
        longest = self._patience.quiet_s if self.child.pulsed else self._patience.start_s
        if now - self.child.seen > longest:
            self._gone(self.child.end(signal.SIGKILL, 0.0), f"it said nothing for {longest:g} s, and was killed")
        return said

    def end(self, within_s: float) -> None:
        """Have it end within ``within_s`` [s], and begin it no more."""
        if self.child is not None:
            self.status = self.child.end(signal.SIGTERM, within_s)
            self.child = None

    def _begin(self) -> None:
        try:
            self.child = Child(self._work)
        except OSError as full:  # who minds the others must not end by it
            wait_s = self._again(self._deaths + 1)
            self._tell(f"{self._name} could not be started: {full.strerror}; it is tried again in {wait_s:g} s")
            return
        if self._deaths:
            self._tell(f"{self._name} was started again, process {self.child.pid}")

    def _gone(self, status: int, how: str) -> None:
        assert self.child is not None
        lasted = time.monotonic() - self.child.began
        self.child, self.status = None, status
        wait_s = self._again(1 if lasted >= self._patience.lasts_s else self._deaths + 1)
        self._tell(f"{self._name} is gone: {how}; it is started again in {wait_s:g} s")

    def _again(self, deaths: int) -> float:
        """Have it begun after so many ``deaths`` in a row; the wait until then, wall-clock [s]."""
        self._deaths, wait_s = deaths, 0.0
        if deaths > 1:
            wait_s = min(self._patience.again_s * 2.0 ** min(deaths - 2, 60), self._patience.most_s)
        self._due = time.monotonic() + wait_s
        return wait_s
