"""How often passwords and codes may be tried: after a few failures the next one must wait, longer and longer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, final

FREE: Final = 5
"""Failures in a row that cost nothing: people mistype."""
FORGOTTEN_S: Final = 900.0
"""Failures before this are forgotten, wall-clock [s]."""
MOST: Final = 10_000
"""Most names and addresses that are remembered."""


@final
class Tries:
    """Counts failures by whose they are."""

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
        self._failed: dict[str, tuple[int, float]] = {}

    def wait_s(self, *who: str) -> float:
        """How long the next try by any of these must wait [s]; 0 where it need not."""
        now, longest = self._clock(), 0.0
        for key in who:
            count, last = self._failed.get(key, (0, now))
            if count >= FREE:
                longest = max(longest, last + min(self._longest_s, 2.0 ** min(count - FREE, 30)) - now)
        return longest

    def failed(self, *who: str) -> None:
        """Each of these has failed once more."""
        now = self._clock()
        for key in who:
            count, last = self._failed.pop(key, (0, now))
            self._failed[key] = (1 if now - last > self._forgotten_s else count + 1, now)
        while len(self._failed) > MOST:
            self._failed.pop(next(iter(self._failed)))

    def succeeded(self, *who: str) -> None:
        """Each of these has shown who it is."""
        for key in who:
            self._failed.pop(key, None)
