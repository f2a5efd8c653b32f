"""What the guard journals of modes, people and alarms."""

from dataclasses import dataclass
from typing import ClassVar

from homeostat.domain.alarm import Priority
from homeostat.domain.mode import Role


@dataclass(frozen=True, slots=True)
class ModeEntered:
    """The plant's mode has changed."""

    kind: ClassVar[str] = "mode-entered"
    mode: str
    """The mode."""
    person: str
    """Who changed it; empty at the start of a run."""
    reason: str = ""
    """Why."""


@dataclass(frozen=True, slots=True)
class ServiceChanged:
    """A writable tag went out of service or came back."""

    kind: ClassVar[str] = "service-changed"
    tag: str
    """Name of the tag."""
    in_service: bool
    """Whether the guard may write it."""
    person: str
    """Who did; empty where somebody unknown moved the tag."""
    reason: str
    """Why."""


@dataclass(frozen=True, slots=True)
class PersonHeard:
    """A person ordered something, and got an answer."""

    kind: ClassVar[str] = "person-heard"
    command: str
    """Identifier of the order."""
    person: str
    """Who."""
    role: Role
    """In which role."""
    verb: str
    """What was ordered."""
    subject: str
    """What it was about."""
    done: bool
    """Whether it was carried out."""
    reason: str = ""
    """Why, or why not."""
    check: str = ""
    """Name of the check that refused it; empty where none of the plant's did."""
    missing: int = 0
    """People who must order it too: it counts, and is carried out once they do; 0 where nobody must."""


@dataclass(frozen=True, slots=True)
class AlarmRaised:
    """An abnormal condition began."""

    kind: ClassVar[str] = "alarm-raised"
    alarm: str
    """Identifier of the alarm."""
    cause: str
    """One sentence."""
    priority: Priority
    """How soon a person must respond."""


@dataclass(frozen=True, slots=True)
class AlarmReturned:
    """An abnormal condition ended."""

    kind: ClassVar[str] = "alarm-returned"
    alarm: str
    """Identifier of the alarm."""


@dataclass(frozen=True, slots=True)
class AlarmAcknowledged:
    """A person has seen an alarm."""

    kind: ClassVar[str] = "alarm-acknowledged"
    alarm: str
    """Identifier of the alarm."""
    person: str
    """Who."""


@dataclass(frozen=True, slots=True)
class AlarmShelved:
    """A person has shelved an alarm."""

    kind: ClassVar[str] = "alarm-shelved"
    alarm: str
    """Identifier of the alarm."""
    person: str
    """Who."""
    reason: str
    """Why."""
    until_s: float
    """Process time until which it is not shown among the others, unless it is shown again before [s]."""


@dataclass(frozen=True, slots=True)
class AlarmUnshelved:
    """A shelved alarm is shown again."""

    kind: ClassVar[str] = "alarm-unshelved"
    alarm: str
    """Identifier of the alarm."""
    person: str
    """Who ordered it; empty where its time was over."""
