"""Alarms: what a person must know now (ISA-18.2, IEC 62682)."""

from dataclasses import dataclass
from enum import StrEnum


class Priority(StrEnum):
    """How soon a person must respond."""

    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"
    CRITICAL = "critical"


@dataclass(frozen=True, slots=True)
class Alarm:
    """One abnormal condition that calls for a response."""

    id: str
    """What is wrong, the same each time it returns: ``trip:LIM-T-HIGH``, ``journal``."""
    cause: str
    """One sentence with the thing, the value and the limit."""
    priority: Priority
    """How soon a person must respond."""
    raised_s: float
    """Process time at which the condition began [s]."""
    acknowledged_by: str | None = None
    """Who has seen it; None while nobody has."""
    returned_s: float | None = None
    """Process time at which the condition ended; None while it lasts [s]."""
