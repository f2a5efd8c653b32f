"""How often passwords and codes may be tried: after a few failures the next one must wait, longer and longer."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Final, final

FREE: Final = 5
"""Failures in a row that cost nothing: people mistype."""
FORGOTTEN_S: Final = 900.0
"""Failures before this are forgotten, wall-clock [s]."""
MOST: Final = 10_000
"""Most names and addresses that are remembered."""


_KEPT: Final = 64
"""Last failures of each that are remembered: as many as it takes to the longest wait, and more."""


@final
class Tries:
    """Counts failures by whose they are; it may be asked from any thread."""

    def __init__(
        self,
        clock: Callable[[], float],
        longest_s: float,
        forgotten_s: float = FORGOTTEN_S,
    ) -> None:
        """Nobody has failed yet; ``clock`` tells seconds and is set by nobody.

        ``longest_s`` is the longest wait [s]; failures before ``forgotten_s`` are forgotten [s].
        """
        self._clock, self._longest_s, self._forgotten_s = clock, longest_s, forgotten_s
        self._failed: dict[str, deque[tuple[float, str]]] = {}
        self._alone = threading.Lock()

    def wait_s(self, *who: str) -> float:
        """How long the next try by any of these must wait [s]; 0 where it need not."""
        now, longest = self._clock(), 0.0
        with self._alone:
            for key in who:
                failed = self._failed.get(key)
                if failed is not None and len(failed) >= FREE:
                    longest = max(longest, failed[-1][0] + self._wait_s(len(failed)) - now)
        return longest

    def _wait_s(self, count: int) -> float:
        return min(self._longest_s, 2.0 ** min(count - FREE, 30))

    def failed(self, *who: str, by: str = "") -> None:
        """Each of these has failed once more; ``by`` says whose doing that was."""
        now = self._clock()
        with self._alone:
            for key in who:
                before = self._failed.pop(key, deque(maxlen=_KEPT))
                if before and now - before[-1][0] > self._forgotten_s:
                    before.clear()
                before.append((now, by))
                self._failed[key] = before
            while len(self._failed) > MOST:
                self._failed.pop(next(iter(self._failed)))

    def succeeded(self, *who: str, by: str = "") -> None:
        """Each of these has shown who it is: what was ``by`` the same is forgiven, and nothing else."""
        with self._alone:
            for key in who:
                left = [one for one in self._failed.pop(key, ()) if one[1] != by]
                if left:
                    self._failed[key] = deque(left, _KEPT)
