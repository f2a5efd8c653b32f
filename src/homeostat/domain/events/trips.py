"""What the guard journals of trips, the latch and the fallback."""

from dataclasses import dataclass
from typing import ClassVar

from homeostat.domain.recovery import Command


@dataclass(frozen=True, slots=True)
class Tripped:
    """A hard limit is violated or cannot be judged any more."""

    kind: ClassVar[str] = "tripped"
    limit: str
    """Name of the limit."""
    margin: float
    """Margin of the readings, in ``unit``; NaN where it cannot be judged."""
    unit: str
    """Unit of the margin."""
    reason: str
    """One sentence."""
    acted: bool
    """Whether a fallback follows; in observe and advise a trip is an alarm."""
    seen: bool = True
    """Whether anything has shown that it is violated; False where it only cannot be judged. It is told again where that
    is seen later."""


@dataclass(frozen=True, slots=True)
class TripLifted:
    """A violated reading does not trip, because a diagnosis explains it and another instrument carries the limit."""

    kind: ClassVar[str] = "trip-lifted"
    limit: str
    """Name of the limit."""
    carrier: str
    """Formula that carries it meanwhile."""
    until_s: float
    """Process time at which the reading counts again [s]."""


@dataclass(frozen=True, slots=True)
class TripLiftEnded:
    """A reading whose trip was lifted has come back, or counts again."""

    kind: ClassVar[str] = "trip-lift-ended"
    limit: str
    """Name of the limit."""
    used_s: float
    """For how long its trip has been lifted by now, all in all [s]."""


@dataclass(frozen=True, slots=True)
class Latched:
    """A fallback was activated; nothing more is released until a person resets the latch."""

    kind: ClassVar[str] = "latched"
    reason: str
    """Why."""


@dataclass(frozen=True, slots=True)
class LatchReset:
    """A person has reset the latch; the guard stands in observe."""

    kind: ClassVar[str] = "latch-reset"
    persons: tuple[str, ...]
    """Who did."""
    reason: str
    """Why, in their words."""
    state: str
    """State that the plant was found in."""
    candidates: tuple[str, ...] = ()
    """States that it may as well be in, that one among them; empty where it is plain."""


@dataclass(frozen=True, slots=True)
class FallbackActivated:
    """The fallback acted."""

    kind: ClassVar[str] = "fallback-activated"
    strategy: str
    """Name of the strategy."""
    commands: tuple[Command, ...]
    """What was written."""
    reason: str
    """Why."""
    answers: tuple[str, ...] = ()
    """Violated limits against which it was chosen; none where another strategy was not obeyed."""


@dataclass(frozen=True, slots=True)
class FallbackStands:
    """The plant was read back and holds every target of the fallback."""

    kind: ClassVar[str] = "fallback-stands"
    strategy: str
    """Name of the strategy."""


@dataclass(frozen=True, slots=True)
class FallbackSkipped:
    """A strategy did not pass its checks or was not obeyed; the next one acts."""

    kind: ClassVar[str] = "fallback-skipped"
    strategy: str
    """Name of the strategy."""
    reason: str
    """Which check failed, or what the plant did not obey."""


@dataclass(frozen=True, slots=True)
class FallbackIneffective:
    """A strategy stands, and a violated limit has not come nearer in the time that the tables give it."""

    kind: ClassVar[str] = "fallback-ineffective"
    strategy: str
    """Name of the strategy."""
    limit: str
    """Name of the limit."""
    reason: str
    """One sentence."""
    acted: bool
    """Whether it is given up, and the next one acts; where it is kept, and in observe and advise, it is an alarm."""


@dataclass(frozen=True, slots=True)
class EffectFollowed:
    """How far the time has come in which a strategy that stands must help; a restart goes on from here."""

    kind: ClassVar[str] = "effect-followed"
    strategy: str
    """Name of the strategy."""
    limit: str
    """Name of the violated limit."""
    judged_s: float
    """When this was so, process time [s]."""
    passed_s: float
    """How much of the time is over [s]."""
    sums: tuple[float, ...]
    """Ticks, ticks in which the margin was judged, and over these the sums of t, t*t, m, m*m and t*m."""


@dataclass(frozen=True, slots=True)
class Shed:
    """The heartbeat stops, and the plant's own control goes on by itself."""

    kind: ClassVar[str] = "shed"
    reason: str
    """Why."""
