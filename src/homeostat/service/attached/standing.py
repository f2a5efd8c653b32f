"""What writing needs of the link: where it was lost, the mode goes down to observe."""

from collections.abc import Callable
from typing import Protocol, final

from homeostat.domain.mode import Mode
from homeostat.domain.observation import StandBack

APART = 3
"""Ticks in a row in which the clocks must differ before that counts: one late sample says nothing of a clock."""


class Connected(Protocol):
    """A link as far as it tells of its connection."""

    @property
    def trouble(self) -> str:
        """Why there is no connection; empty while there is one."""
        ...

    @property
    def connections(self) -> int:
        """Goes up with every connection that was up, and with every one that was lost."""
        ...

    @property
    def permitted(self) -> bool:
        """Whether the plant's operators let us write."""
        ...

    @property
    def clock_s(self) -> float:
        """How far the server's clock is ahead of ours [s]."""
        ...


@final
class Standing:
    """Looks at the link before every tick."""

    def __init__(self, link: Connected, most_s: float, put: Callable[[StandBack], object]) -> None:
        """``most_s``: largest difference between the two clocks [s]; ``put`` takes what the guard is told."""
        self._link, self._most_s, self._put = link, most_s, put
        self._connections, self._apart = link.connections, 0

    def look(self, mode: Mode) -> None:
        """Have the guard observe where it stands in a ``mode`` that is more, and what that needs was lost."""
        connections, lost = self._link.connections, ""
        if self._link.trouble:
            lost = f"the connection was lost: {self._link.trouble}"
        elif connections != self._connections:
            lost = "the connection was lost and made again"
        self._connections = connections
        self._apart = self._apart + 1 if abs(self._link.clock_s) > self._most_s else 0
        if not lost and self._apart >= APART:
            lost = f"the plant's clock is {self._link.clock_s:+.1f} s from ours, {self._most_s:g} s are allowed"
        if not lost and not self._link.permitted and mode.writes:
            lost = "the plant's operators do not permit writing any more"
        if lost and mode is not Mode.OBSERVE:
            self._put(StandBack(lost))
