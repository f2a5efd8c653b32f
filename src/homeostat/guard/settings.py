"""Times that the guard waits for links, journals and people; the plant's own numbers are in its tables."""

import math
from dataclasses import dataclass, fields, replace
from typing import Self

LEASE_WITHIN_S = 10.0
"""Longest that a link may need for a lease where its plant states nothing else [s]."""
LONGEST_LEASE_S = 600.0
"""Longest that a link may be allowed to need for a lease [s]: as long as the longest wait between two attempts."""


@dataclass(frozen=True, slots=True)
class GuardSettings:
    """Times and counts of the guard."""

    write_s: float = 3.0
    """A link that has not answered a write after this long is given up [s]."""
    attempts: int = 3
    """Most attempts at one write before it has failed."""
    again_s: float = 10.0
    """After a write of the sequence or of a fallback has failed, when it is begun again [s]."""
    check_age_s: float = 30.0
    """Oldest release check on which something is released [s]."""
    person_s: float = 600.0
    """The same where a person has to say yes first [s]."""
    order_s: float = 60.0
    """Oldest order of a person that is carried out, between its issue and its delivery, wall-clock [s]."""
    persons: int = 1
    """People who must agree to a reset and to closed loop: one in simulation, two on a link."""
    sync_s: float = 0.1
    """Longest wait for the journal, wall-clock [s]; a fallback waits 0.1 s at most, and goes without its sync then."""
    call_s: float = 0.2
    """Longest wait for a link that may block to come back from a write or a heartbeat, wall-clock [s]."""
    lease_s: float = 0.5
    """The same for a lease: without one not even a fallback can be sent. What is late is awaited."""
    lease_within_s: float = LEASE_WITHIN_S
    """Longest that the plant's link may need to give a lease, wall-clock [s]: later it is an alarm.

    What comes late is kept for so long, for whoever asks for it again, and then given back.
    """

    def for_ticks(self, tick_s: float) -> Self:
        """The same for a plant that is sampled every ``tick_s`` [s].

        What is waited for on the process clock is seen at a tick, so that it is waited for longer where that is longer
        than a second.
        """
        factor = max(tick_s, 1.0)
        return replace(
            self,
            write_s=self.write_s * factor,
            again_s=self.again_s * factor,
            check_age_s=self.check_age_s * factor,
            person_s=self.person_s * factor,
        )

    def __post_init__(self) -> None:
        for name in (field.name for field in fields(self) if field.name.endswith("_s")):
            seconds = getattr(self, name)
            if not (math.isfinite(seconds) and seconds > 0.0):
                raise ValueError(f"{name} is {seconds!r} s; it must be finite and more than 0 s")
        if self.lease_within_s > LONGEST_LEASE_S:
            raise ValueError(
                f"lease_within_s is {self.lease_within_s!r} s; at most {LONGEST_LEASE_S:g} s are waited for"
            )
        if self.attempts < 1 or self.persons < 1:
            raise ValueError(f"{self.attempts!r} attempts and {self.persons!r} persons; at least one of each is needed")
