"""What tests may do to a link in virtual time, beside what a guard does."""

from __future__ import annotations

from typing import Protocol

from homeostat.domain.ports import Lease, Wire
from homeostat.links.virtual import Arrival, VirtualSource


class VirtualLink(VirtualSource, Lease, Protocol):
    """A plant in virtual time, with everything that a test may do to it."""

    def take(self) -> Wire:
        """Take the lease; LinkError where the plant does not give it."""
        ...

    @property
    def source(self) -> VirtualSource:
        """The reading side alone."""
        ...

    @property
    def wire_log(self) -> tuple[Arrival, ...]:
        """What arrived on the wire, the oldest first."""
        ...

    @property
    def shed(self) -> bool:
        """Whether the plant's own control has taken over because the guard is gone."""
        ...

    def operate(self, tag: str, value: float | None, rate: float | None = None) -> None:
        """Somebody at the plant moves ``tag``; not a matter of the wire."""
        ...
