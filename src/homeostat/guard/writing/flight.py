"""A write on its way: what is sent together, how far it has come, and when the plant holds it."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from homeostat.domain.events.writes import Cause
from homeostat.domain.ports import Ticket
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.snapshot import Snapshot

ROUNDING = 1e-9
"""Rounding of a target that is sent and read back, in any unit."""
PUT_RIGHT = "put right"
"""Source of a write that puts right what came late; it belongs to no strategy."""


@dataclass(frozen=True, slots=True)
class Write:
    """Commands that belong together, and on whose behalf they are sent."""

    cause: Cause
    """On whose behalf."""
    source: str
    """Name of the request, strategy, transition or person."""
    commands: tuple[Command, ...]
    """What is sent, in order."""
    state: str
    """State of the machine that they lead to."""
    digest: str = ""
    """Digest of the action set that they begin; empty where there is none."""
    then: tuple[Step, ...] = ()
    """What follows once the plant has taken them."""

    @classmethod
    def of(cls, cause: Cause, source: str, actions: ActionSet) -> Write:
        """The write that begins ``actions``."""
        return cls(cause, source, actions.commands, actions.target, actions.digest, actions.then)


class Progress(StrEnum):
    """How far a write has come."""

    ACCEPTED = "accepted"
    """The link has just taken it; its effect is not read yet."""
    CONFIRMED = "confirmed"
    """The plant holds every target."""


@dataclass(slots=True)
class Flight:
    """The write that is under way."""

    write: Write
    """What is sent."""
    number: int
    """Number of the write."""
    attempt: int
    """Number of the last attempt; 0 before the first."""
    ticket: Ticket | None
    """The link's answer to that attempt; None where there is none."""
    sent_s: float
    """When that attempt was sent [s]."""
    accepted_s: float | None = None
    """When the link took that attempt [s]; None while it has not."""
    ended: bool = field(init=False)
    """Whether that attempt has an outcome."""
    error: str = field(init=False)
    """What went wrong last, as the link or the guard says it; empty where nothing did."""
    held: set[str] = field(default_factory=set)
    """Tags that were read at their target since it was sent."""
    covered: set[str] = field(default_factory=set)
    """Tags that another write commanded since this one was given up: reading them says nothing of this one."""
    unread: set[str] = field(default_factory=set)
    """Those of them for which there was no reading before."""
    read: set[str] = field(default_factory=set)
    """Tags whose target was read since it was sent."""

    def cover(self, tags: set[str]) -> None:
        """Another write commands ``tags``."""
        self.covered |= tags
        self.unread |= tags - self.read


@dataclass(frozen=True, slots=True)
class GivenUp:
    """A write that was given up, as the plant was read after it."""

    write: Write
    """The write."""
    written: tuple[Command, ...]
    """What of it the plant was read to hold."""
    missing: tuple[Command, ...]
    """What of it the plant was never read to hold; what was overwritten unread is in neither."""
    taken: bool
    """Whether the link had taken all of it."""

    def __str__(self) -> str:
        """What was written of it and what was not, for a person."""
        known = {c.tag for c in (*self.written, *self.missing)}
        unknown = tuple(c for c in self.write.commands if c.tag not in known)
        text = f"{self.write.source} was carried out in part: {_shown(self.written)}"
        text += f"; not {_shown(self.missing)}" if self.missing else ""
        return text + (f"; overwritten unread {_shown(unknown)}" if unknown else "")

    @property
    def whole(self) -> bool:
        """Whether the plant was read to hold all of it."""
        return len(self.written) == len(self.write.commands)


@dataclass(frozen=True, slots=True)
class Failed:
    """Every attempt at a write was made, and the plant does not hold every target."""

    error: str
    """What went wrong last, as the link or the guard says it; empty where nothing did."""
    read: GivenUp | None
    """What was read of the write; None where the plant was not read after it."""
    unread: bool = False
    """Whether nothing that was read after the last attempt says that the plant holds another target than was sent."""

    @property
    def reason(self) -> str:
        """Why it has failed, for a person."""
        return self.error or "the plant does not hold every target after every attempt"


def _shown(commands: tuple[Command, ...]) -> str:
    """Commands for a person."""
    return ", ".join(f"{c.tag} = {shown(c.value)}" for c in commands) or "nothing"


def shown(target: float | None) -> str:
    """A target for a person, in the tag's unit."""
    return "automatic" if target is None else f"{target:g}"


def outcome(flight: Flight) -> GivenUp:
    """What is known of a ``flight`` that was given up."""
    commands = flight.write.commands
    missing = tuple(c for c in commands if c.tag not in flight.held | flight.unread)
    written = tuple(c for c in commands if c.tag in flight.held)
    return GivenUp(flight.write, written, missing, flight.accepted_s is not None)


def holds(command: Command, readings: Snapshot, tolerance: float) -> bool:
    """Whether the plant has accepted the target of ``command``; a target that it does not tell is not known to hold."""
    return command.tag in readings.accepted and same(command.value, readings.accepted[command.tag], tolerance)


def between(target: float | None, one: float | None, other: float | None, tolerance: float) -> bool:
    """Whether ``target`` lies between two others, within ``tolerance``; automatic lies between nothing."""
    if target is None or one is None or other is None:
        return False
    low, high = sorted((one, other))
    return low - tolerance - ROUNDING <= target <= high + tolerance + ROUNDING


def same(one: float | None, other: float | None, tolerance: float) -> bool:
    """Whether two targets are the same within ``tolerance``; None, automatic, is the same as None only."""
    if one is None or other is None:
        return one is None and other is None
    return abs(one - other) <= tolerance + ROUNDING
