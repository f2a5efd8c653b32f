"""The hash chain: every line carries the SHA-256 of the line before it, so that no line can change unnoticed."""

import hashlib
import math
from typing import final

from homeostat.journal.encode import Json, canonical, encode_fields
from homeostat.journal.events import Event

GENESIS = "0" * 64
"""What the first line carries in place of a digest."""

HEADER = ("seq", "prev", "at_s", "event")
"""Keys with which every line starts; no event may have a field of these names."""
HAPPENED = "happened_s"
"""Key after the header, only where an event happened before the line's time: its own process time [s]."""


def digest(line: bytes) -> str:
    """SHA-256 of a line without its newline, in hexadecimal."""
    return hashlib.sha256(line).hexdigest()


@final
class Chain:
    """The state of a growing chain: how many lines, and the digest and the time of the last."""

    def __init__(self, count: int = 0, last: str = GENESIS, at_s: float = -math.inf) -> None:
        """A chain of ``count`` lines; the last has the digest ``last`` and the process time ``at_s`` [s]."""
        self.count = count
        self.last = last
        self.at_s = at_s
        self._classes: dict[str, type] = {}

    def draft(self, event: Event, at_s: float) -> bytes:
        """The line that would come next, without newline; the chain itself does not move until `commit`.

        The times of lines never decrease: an event that is recorded late gets the time of the line before, and its own
        time under `HAPPENED`.
        """
        if not math.isfinite(at_s):
            raise ValueError(f"event {event.kind!r} at {at_s!r} s: the process time must be finite")
        fields = encode_fields(event, event.kind)
        taken = [name for name in (*HEADER, HAPPENED) if name in fields]
        if taken:
            raise TypeError(f"event {event.kind!r} has a field {taken[0]!r}, which every line has already; rename it")
        owner = self._classes.setdefault(event.kind, type(event))
        if owner is not type(event):
            raise TypeError(
                f"kind {event.kind!r} names both {owner.__name__!r} and {type(event).__name__!r}; rename one of them"
            )
        header: dict[str, Json] = {
            "seq": self.count + 1,
            "prev": self.last,
            "at_s": max(float(at_s), self.at_s),
            "event": event.kind,
        }
        if at_s < self.at_s:
            header[HAPPENED] = float(at_s)
        return canonical({**header, **fields}).encode("ascii")

    def commit(self, line: bytes, at_s: float) -> None:
        """Make ``line``, which is stored now and whose event happened at ``at_s`` [s], the last of the chain."""
        self.count += 1
        self.last = digest(line)
        self.at_s = max(float(at_s), self.at_s)
