"""Pacing: a run in virtual time that waits between two ticks, so that people can follow it, or stands as they wish."""

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final, final

SLOWEST: Final = 0.1
"""Least speed, in process seconds per second [1]."""
FASTEST: Final = 1000.0
"""Greatest speed [1]."""
AWAITED_S: Final = 2.0
"""Longest wait between two ticks while a person waits for the guard's answer, wall-clock [s]. The guard hears an order
at the second tick after it was given, and a tick may be a minute of process time."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How a run goes on."""

    speed: float
    """Process seconds per wall-clock second [1]."""
    paused: bool
    """Whether somebody wants it to stand."""
    stands: bool
    """Whether it does: what is thought comes to its end first."""


@final
class Pacing:
    """The pace of one run; any thread may change it. What happens in the run does not depend on it."""

    def __init__(self, speed: float) -> None:
        """Go on at ``speed`` process seconds per second; ValueError where that is none from 0.1 to 1000."""
        self._changed = threading.Condition()
        self._speed, self._due_s = _checked(speed), time.monotonic()
        self._paused = self._stands = self._over = False
        self._awaited = 0

    @property
    def now(self) -> Pace | None:
        """The pace now; None once the run is over."""
        with self._changed:
            return None if self._over else Pace(self._speed, self._paused, self._stands)

    def pause(self) -> None:
        """Have the run stand before its next tick, as long as nobody lets it go on."""
        with self._changed:
            self._paused = True
            self._changed.notify_all()

    def go_on(self) -> None:
        """End the pause."""
        with self._changed:
            if self._paused:
                self._paused, self._stands, self._due_s = False, False, time.monotonic()
            self._changed.notify_all()

    def choose(self, speed: float) -> None:
        """Go on at ``speed``, from now on; ValueError as at the beginning."""
        with self._changed:
            now_s = time.monotonic()
            self._due_s = now_s + max(self._due_s - now_s, 0.0) * self._speed / _checked(speed)
            self._speed = speed
            self._changed.notify_all()

    @contextmanager
    def answering(self) -> Iterator[None]:
        """Meanwhile somebody waits for the guard's answer: ticks are never far apart, and the run stands afterwards."""
        with self._changed:
            self._awaited += 1
            self._changed.notify_all()
        try:
            yield
        finally:
            with self._changed:
                self._awaited -= 1
                self._changed.notify_all()

    def wait(self, tick_s: float, at_rest: bool) -> None:
        """Return when the tick after one of ``tick_s`` [s] is due.

        Where the run is not ``at_rest``, somebody thinks by a clock that a wait would cheat: it goes on at once, and
        stands the longer afterwards. A tick that comes late is not made up for.
        """
        with self._changed:
            self._due_s = max(self._due_s + tick_s / self._speed, time.monotonic())
            if not at_rest:
                return
            begun_s = time.monotonic()
            while not self._over and (left_s := self._left_s(begun_s)) > 0.0:
                self._stands = left_s == math.inf
                self._changed.wait(None if self._stands else left_s)
            self._stands = False

    def end(self) -> None:
        """There is no further tick, and nobody waits for one."""
        with self._changed:
            self._over, self._paused, self._stands = True, False, False
            self._changed.notify_all()

    def _left_s(self, begun_s: float) -> float:
        """How long the tick is still to be waited for that was waited for from ``begun_s`` on [s]."""
        due_s = math.inf if self._paused else self._due_s
        return (min(due_s, begun_s + AWAITED_S) if self._awaited else due_s) - time.monotonic()


def _checked(speed: float) -> float:
    if not (math.isfinite(speed) and SLOWEST <= speed <= FASTEST):
        raise ValueError(f"speed {speed!r} must be from {SLOWEST:g} to {FASTEST:g} process seconds per second")
    return speed
