"""Certified: what a record says of how likely an action set is to violate a hard limit."""

from collections.abc import Iterable

from homeostat.domain.certificate import Certificate
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.recovery import Compared, ReleasedActions
from homeostat.journal.memory import Entry


def certified(entries: Iterable[Entry], digest: str, since_s: float = 0.0) -> Certificate | None:
    """What was said last of the action set with this ``digest`` from process time ``since_s`` on [s].

    By a release check or by a list that it stood in, whichever came last; None where that list says nothing.
    """
    found: Certificate | None = None
    for entry in entries:
        if entry.at_s < since_s:
            continue
        match entry.event:
            case Compared(alternatives=alternatives) if any(a.digest == digest for a in alternatives):
                found = next(a.certificate for a in alternatives if a.digest == digest)
            case Foreseen(digest=other, certificate=shown) | ReleasedActions(digest=other, certificate=shown):
                if other == digest and shown is not None:
                    found = shown
    return found
