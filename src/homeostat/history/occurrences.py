"""Events of a journal as occurrences of a history."""

from typing import Final

from homeostat.domain.alarm import Priority
from homeostat.domain.events.people import AlarmRaised
from homeostat.history.store import Occurrence
from homeostat.journal import Event
from homeostat.journal.encode import canonical, encode_fields

SEVERITIES: Final = {Priority.LOW: 200, Priority.MEDIUM: 400, Priority.HIGH: 700, Priority.CRITICAL: 900}
"""Priority of an alarm -> its severity (OPC UA Part 9)."""
ALARM: Final = "alarm"
"""Kind of an alarm in a history."""
_EVENT: Final = 1
"""Severity of what is no alarm."""


def occurrence(event: Event, plant: str, at_us: int, own_us: int, text: str) -> Occurrence:
    """``event`` of ``plant``, which happened at ``at_us`` and was heard of at ``own_us`` [us].

    ``text`` tells it; empty where nobody does.
    """
    details = canonical(encode_fields(event, event.kind))
    if isinstance(event, AlarmRaised):
        severity, said = SEVERITIES[event.priority], text or event.cause
        return Occurrence(at_us, own_us, ALARM, event.alarm, severity, said, details)
    return Occurrence(at_us, own_us, event.kind, plant, _EVENT, text or event.kind, details)
