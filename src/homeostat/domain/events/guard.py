"""What the guard journals: writes from intention to read-back, trips, requests, people, alarms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from homeostat.domain.alarm import Priority
from homeostat.domain.events.writes import StepLoaded
from homeostat.domain.mode import Role
from homeostat.domain.recovery import Command


@dataclass(frozen=True, slots=True)
class GuardStarted:
    """The guard begins to watch a plant, for the first time or again."""

    kind: ClassVar[str] = "guard-started"
    plant: str
    """Name of the plant."""
    configuration: str
    """Digest of tables, graph, settings and baselines."""
    mode: str
    """Mode in which it stands."""
    recipe: str
    """Who runs the nominal sequence."""
    restored: bool
    """Whether it goes on from a journal."""


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
    """Whether it is given up, and the next one acts; in observe and advise it is an alarm."""


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


@dataclass(frozen=True, slots=True)
class StateEntered:
    """The supervisory state machine entered a state."""

    kind: ClassVar[str] = "state-entered"
    state: str
    """Name of the state."""


@dataclass(frozen=True, slots=True)
class RequestAnswered:
    """The guard said something of a request."""

    kind: ClassVar[str] = "request-answered"
    request: str
    """Identifier of the request."""
    proposer: str
    """Who proposed it."""
    digest: str
    """Digest of its action set."""
    status: str
    """How far it came."""
    check: str = ""
    """Name of the check that refused it."""
    reason: str = ""
    """One sentence."""


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
class QualityChanged:
    """A reading is good, uncertain or bad from now on."""

    kind: ClassVar[str] = "quality-changed"
    tag: str
    """Name of the tag."""
    quality: str
    """What it is now."""
    reason: str
    """Why."""


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
class Armed:
    """Recovery has ranked the fallbacks, and perhaps said until when it must have acted."""

    kind: ClassVar[str] = "armed"
    strategies: tuple[str, ...]
    """Names, the one that acts first at the front."""
    act_by_s: float | None
    """Process time at which the first one acts unless something was released [s]; None for no such time."""


@dataclass(frozen=True, slots=True)
class StartUpBegan:
    """Start-up begins, with limits of its own."""

    kind: ClassVar[str] = "start-up-began"
    state: str
    """State that the plant is in."""
    since_s: float
    """Process time from which its longest duration counts [s]."""


@dataclass(frozen=True, slots=True)
class StartUpEnded:
    """The limits of start-up hold no more; every limit counts."""

    kind: ClassVar[str] = "start-up-ended"
    state: str
    """State that the plant is in."""
    reason: str = ""
    """Why: it was left, it could be left, or it has lasted too long."""


@dataclass(frozen=True, slots=True)
class Stopped:
    """The guard was stopped by a person: after tracking back it stops the heartbeat, and writes nothing."""

    kind: ClassVar[str] = "stopped"
    reason: str
    """Why."""


@dataclass(frozen=True, slots=True)
class SequenceLoaded:
    """The sequencer goes on with something else; a restart takes its position from here."""

    kind: ClassVar[str] = "sequence-loaded"
    source: str
    """Name of the request or strategy; empty for the nominal sequence."""
    state: str
    """State that the plant is in from now on."""
    steps: tuple[StepLoaded, ...]
    """What follows, in order."""
    aborting: bool
    """Whether it belongs to a fallback."""


@dataclass(frozen=True, slots=True)
class StepTaken:
    """The plant has got the commands of the step that waited."""

    kind: ClassVar[str] = "step-taken"
    transition: str
    """Name of the transition that it takes."""
    state: str
    """State that the plant is in from now on."""
