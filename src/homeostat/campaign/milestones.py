"""The moments of a run that a reader looks for: reports, releases, the fallback, the supervisory states."""

from __future__ import annotations

from dataclasses import dataclass

from homeostat.domain.guard_events import FellBack, StateEntered
from homeostat.trace.decisions import Attempted, Diagnosed, ReleasedActions
from homeostat.trace.events import Event


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
        self.releases: list[Moment] = []
        """Releases, each with the state that it led to."""
        self.fallbacks: list[Moment] = []
        """Moments at which a fallback acted, each with its strategy."""
        self.states: list[Moment] = []
        """Supervisory states, each from the time at which it was entered."""
        self.reason = ""
        """Why the first fallback acted; empty where none did."""
        self.approved: Attempted | None = None
        """The attempt that was released first; None where none was."""
        self._last: Attempted | None = None

    def __call__(self, event: Event, at_s: float) -> None:
        """Take one event."""
        match event:
            case Diagnosed():
                self.reports.append(at_s)
            case Attempted():
                self._last = event
            case ReleasedActions():
                self.approved = self.approved or self._last
                self.releases.append(Moment(at_s, event.target))
            case FellBack():
                self.reason = self.reason or event.reason
                self.fallbacks.append(Moment(at_s, event.strategy))
            case StateEntered():
                self.states.append(Moment(at_s, event.state))
