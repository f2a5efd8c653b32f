"""Releases: what was written for a request, by the guard's own word; recovery may be overtaken before it says so."""

from dataclasses import dataclass, replace

from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.recovery import Attempted, ReleasedActions
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.recovery import Command
from homeostat.domain.request import RequestStatus
from homeostat.journal.events import Event


@dataclass(frozen=True, slots=True)
class Release:
    """One request that was written to the plant, wholly, in part or in vain."""

    at_s: float
    """Process time at which the plant was read to hold it, or at which it was first sent where it never did [s]."""
    proposer: str
    """Who proposed it."""
    digest: str
    """Digest of the action set."""
    commands: tuple[Command, ...]
    """What was sent first; empty where only steps for later were released."""
    target: str
    """State that it leads to; empty where the journal does not tell it."""
    approved: Attempted | None
    """The proposal that was approved; None where the journal does not tell it."""

    @property
    def min_margin(self) -> float | None:
        """Least margin of the approval, each criterion in its own unit."""
        return None if self.approved is None else min((f.margin for f in self.approved.findings), default=None)


class Releases:
    """Follows a trace. A request counts once the guard intends to write it, whatever becomes of the write."""

    def __init__(self) -> None:
        """Nothing was released yet."""
        self._proposers: dict[str, str] = {}
        self._approved: dict[str, Attempted] = {}
        self._made: dict[str, Release] = {}

    @property
    def made(self) -> tuple[Release, ...]:
        """Every release, in the order in which they were begun."""
        return tuple(self._made.values())

    def take(self, event: Event, at_s: float) -> bool:
        """Take one event; whether a release begins with it."""
        match event:
            case Attempted() if event.approved:
                self._approved[event.digest] = event
            case WriteIntended() if event.cause is Cause.REQUEST and event.source not in self._made:
                self._begin(event.source, event.digest, event.commands, event.state, at_s)
                return True
            case RequestAnswered():
                return self._answered(event, at_s)
            case ReleasedActions() if all(release.digest != event.digest for release in self._made.values()):
                return self._told(event, at_s)
        return False

    def _answered(self, event: RequestAnswered, at_s: float) -> bool:
        self._proposers[event.request] = event.proposer or self._proposers.get(event.request, "")
        if event.status != RequestStatus.CONFIRMED:
            return False
        begins = event.request not in self._made
        if begins:
            self._begin(event.request, event.digest, (), "", at_s)
        self._made[event.request] = replace(self._made[event.request], at_s=at_s)
        return begins

    def _told(self, event: ReleasedActions, at_s: float) -> bool:
        """By recovery's word alone, in a journal in which the guard does not say what it writes."""
        self._proposers[event.digest] = event.proposer
        self._begin(event.digest, event.digest, event.commands, event.state or event.target, at_s)
        return True

    def _begin(self, name: str, digest: str, commands: tuple[Command, ...], state: str, at_s: float) -> None:
        approved = self._approved.get(digest)
        target = approved.path[-1] if approved is not None and approved.path else state
        self._made[name] = Release(at_s, self._proposers.get(name, ""), digest, commands, target, approved)
