"""Who may write: modes of a plant, who runs its recipe, and what a person may order."""

from dataclasses import dataclass
from enum import StrEnum


class Mode(StrEnum):
    """What Homeostat may do to a plant, each mode more than the one before."""

    OBSERVE = "observe"
    """Nobody writes; a trip is an alarm."""
    ADVISE = "advise"
    """Nobody writes; what would be released is shown."""
    APPROVE = "approve"
    """A request is written after a person's yes; trips, a time to act by that passes, and later steps of what was
    approved go by themselves."""
    CLOSED_LOOP = "closed-loop"
    """Everything that passes the guard is written."""

    @property
    def writes(self) -> bool:
        """Whether anything at all may be written."""
        return self in (Mode.APPROVE, Mode.CLOSED_LOOP)

    @property
    def alone(self) -> bool:
        """Whether recovery's word is enough: its requests are written, and where it gives up the fallback acts."""
        return self is Mode.CLOSED_LOOP


class Side(StrEnum):
    """Which side does something: the plant's own control system or the guard."""

    PLANT = "plant"
    GUARD = "guard"


class Role(StrEnum):
    """What a person may order."""

    OPERATOR = "operator"
    """Approves, rejects, acknowledges, shelves, takes tags in and out of service."""
    ENGINEER = "engineer"
    """Also changes the mode and resets a latch."""


class Verb(StrEnum):
    """What a person orders."""

    APPROVE = "approve"
    REJECT = "reject"
    RESET = "reset"
    MODE = "mode"
    IN_SERVICE = "in-service"
    OUT_OF_SERVICE = "out-of-service"
    ACKNOWLEDGE = "acknowledge"
    SHELVE = "shelve"
    UNSHELVE = "unshelve"
    FALL_BACK = "fall-back"
    START = "start"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class PersonCommand:
    """What a person orders, as it was delivered."""

    id: str
    """Identifier, used once."""
    person: str
    """Who orders it."""
    role: Role
    """In which role."""
    verb: Verb
    """What is ordered."""
    subject: str = ""
    """What it is about: a request, a mode, a tag, an alarm, a transition; empty for a reset."""
    digest: str = ""
    """Digest of the action set that an approval is bound to."""
    reason: str = ""
    """Why, in the person's words."""
    age_s: float = 0.0
    """How old it was when it was delivered, by the clock of whoever delivers it [s]; 0 where it is given here."""
    seconds: float = 0.0
    """For how long an alarm is shelved, in process time [s]; 0 for every other order."""
    login: str = ""
    """Login that counts as the person, where the name is only what was typed there; empty where the name counts."""
