"""Clocks: how much process time passes while agents think."""

import math
import time

WALL_LIMIT_S = 600.0
"""Where the time that thinking costs is declared, one answer is cut off only after this much wall-clock time [s]."""


class ThinkingClock:
    """Wall-clock seconds of thinking times a scale are process seconds."""

    measured = True
    """It charges as the wall clock runs."""
    hang_s = math.inf
    """Whatever hangs is ended by the time that is left."""

    def __init__(self, scale: float = 1.0) -> None:
        """``scale``: process seconds per wall-clock second of thinking; 0 stops the plant while agents think."""
        if not (math.isfinite(scale) and scale >= 0.0):
            raise ValueError(f"thinking scale {scale!r} must be finite and >= 0 process seconds per second")
        self._scale = scale
        self._owed = 0.0
        self._since: float | None = None
        self._settled_s = 0.0

    @property
    def total_s(self) -> float:
        """Wall-clock seconds of thinking so far."""
        return self._settled_s + (0.0 if self._since is None else time.monotonic() - self._since)

    def start(self) -> None:
        """Thinking begins; where it had begun already, it goes on."""
        self._settle()
        self._since = time.monotonic()

    def stop(self) -> None:
        """Thinking ends; what was not collected is still owed."""
        self._settle()
        self._since = None

    def collect_s(self) -> float:
        """Process seconds owed since the last call [s]."""
        self._settle()
        owed, self._owed = self._owed, 0.0
        return owed

    def wall_s(self, process_s: float) -> float:
        """Wall-clock seconds in which ``process_s`` pass [s]; where the process is slow, not longer than that."""
        return process_s / max(self._scale, 1.0)

    def _settle(self) -> None:
        if self._since is not None:
            now = time.monotonic()
            self._settled_s += now - self._since
            self._owed += (now - self._since) * self._scale
            self._since = now


class DeclaredClock:
    """Every stretch of thinking costs the same declared process time: runs are bit-identical on any machine."""

    measured = False
    """It charges the same however long thinking takes."""

    def __init__(self, cost_s: float = 1.0, wall_limit_s: float = WALL_LIMIT_S) -> None:
        """``cost_s``: process seconds that each stretch of thinking takes [s].

        ``wall_limit_s``: wall-clock seconds after which one answer that never ends is cut off [s].
        """
        if not (math.isfinite(cost_s) and cost_s >= 0.0):
            raise ValueError(f"declared thinking time {cost_s!r} must be finite and >= 0 s")
        if not (math.isfinite(wall_limit_s) and wall_limit_s > 0.0):
            raise ValueError(f"wall-clock limit of thinking {wall_limit_s!r} must be finite and > 0 s")
        self._cost_s = cost_s
        self.hang_s = wall_limit_s
        """Wall-clock time after which one answer is taken to hang; all of them together have no end [s]."""
        self._owed = 0.0
        self._since: float | None = None
        self._settled_s = 0.0

    @property
    def total_s(self) -> float:
        """Wall-clock seconds of thinking so far."""
        return self._settled_s + (0.0 if self._since is None else time.monotonic() - self._since)

    def start(self) -> None:
        """Thinking begins; its cost is owed at once."""
        self._owed += self._cost_s
        self._since = time.monotonic()

    def stop(self) -> None:
        """Thinking ends."""
        if self._since is not None:
            self._settled_s += time.monotonic() - self._since
            self._since = None

    def collect_s(self) -> float:
        """Process seconds owed since the last call [s]."""
        owed, self._owed = self._owed, 0.0
        return owed

    def wall_s(self, process_s: float) -> float:
        """The same on every machine, however slow [s]: so long that only what never ends is cut off."""
        return max(process_s, self.hang_s)
