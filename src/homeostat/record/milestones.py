"""The moments of a run that a reader looks for: reports, releases, the fallback, the supervisory states."""

from __future__ import annotations

from dataclasses import dataclass

from homeostat.domain.events.guard import FellBack, StateEntered
from homeostat.domain.events.recovery import Attempted, Diagnosed
from homeostat.journal.events import Event
from homeostat.record.releases import Releases


@dataclass(frozen=True, slots=True)
class Moment:
    """Something that happened once."""

    at_s: float
    """Process time [s]."""
    what: str
    """Name of the state, the proposer or the strategy."""


class Milestones:
    """Follows a trace, or a recorded one, and keeps its moments."""

    def __init__(self) -> None:
        """Nothing has happened yet."""
        self.reports: list[float] = []
        """Process times of monitoring's reports [s]."""
        self.fallbacks: list[Moment] = []
        """Moments at which a fallback acted, each with its strategy."""
        self.states: list[Moment] = []
        """Supervisory states, each from the time at which it was entered."""
        self.reason = ""
        """Why the first fallback acted; empty where none did."""
        self._releases = Releases()

    @property
    def releases(self) -> tuple[Moment, ...]:
        """Releases, each with the state that it leads to."""
        return tuple(Moment(release.at_s, release.target) for release in self._releases.made)

    @property
    def approved(self) -> Attempted | None:
        """The attempt that was released first; None where none was."""
        return next((release.approved for release in self._releases.made), None)

    def __call__(self, event: Event, at_s: float) -> None:
        """Take one event."""
        self._releases.take(event, at_s)
        match event:
            case Diagnosed():
                self.reports.append(at_s)
            case FellBack():
                self.reason = self.reason or event.reason
                self.fallbacks.append(Moment(at_s, event.strategy))
            case StateEntered():
                self.states.append(Moment(at_s, event.state))
