"""Where a journal may lack events: while the guard's own alarm says that its journal does not work, and only then."""

import math
from dataclasses import dataclass
from typing import Final

from homeostat.domain.events.guard import GuardStarted
from homeostat.domain.events.people import AlarmRaised, AlarmReturned
from homeostat.journal.events import Event
from homeostat.journal.reading import Record
from homeostat.journal.verify.evidence import text

ALARM: Final = "journal"
"""Name of the guard's alarm about its journal; recovery's own has a name of its own."""
_CAUSE: Final = "the journal "
"""How the guard begins to say what is wrong with its journal."""
SETTLED_S: Final = 600.0
"""A request that was made in a gap is answered for good within this time after it [s]."""
KINDS: Final[tuple[type[Event], ...]] = (GuardStarted, AlarmRaised, AlarmReturned)
"""Events that a gap follows from."""


@dataclass(slots=True)
class Gap:
    """Follows a journal line by line."""

    standing: bool = False
    """Whether the alarm stands."""
    ended_s: float = -math.inf
    """When it stood last, in process time [s]."""
    _guarded: bool = False

    def follow(self, record: Record) -> bool:
        """Take the next line; whether a gap has just ended."""
        match record.kind:
            case GuardStarted.kind:
                self._guarded = True
                return self._end(record)
            case AlarmRaised.kind if self._guarded and text(record, "alarm") == ALARM:
                self.standing = self.standing or text(record, "cause").startswith(_CAUSE)
            case AlarmReturned.kind if text(record, "alarm") == ALARM:
                return self._end(record)
        return False

    def excuses(self, record: Record) -> bool:
        """Whether what ``record`` follows from may be missing: it stands in a gap, or soon after one."""
        return self.standing or record.at_s <= self.ended_s + SETTLED_S

    def _end(self, record: Record) -> bool:
        ended, self.standing = self.standing, False
        self.ended_s = record.at_s if ended else self.ended_s
        return ended
