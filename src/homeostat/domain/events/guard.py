"""What the guard journals of its watch: states, requests, readings, start-up, the sequence."""

from dataclasses import dataclass
from typing import ClassVar

from homeostat.domain.events.writes import StepLoaded


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
    void_s: float | None = None
    """When it is void unless a person has said yes [s]; None where it does not wait, and in records that are older."""


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
class ReadingJumped:
    """A reading has moved as no process can: limits are watched on it as it is, and as if it had not."""

    kind: ClassVar[str] = "reading-jumped"
    tag: str
    """Name of the tag."""
    by: float
    """What it has jumped by in all, in the unit of the tag; 0 where it has jumped back."""


@dataclass(frozen=True, slots=True)
class Armed:
    """Recovery has ranked the fallbacks, and perhaps said until when it must have acted."""

    kind: ClassVar[str] = "armed"
    strategies: tuple[str, ...]
    """Names, the one that acts first at the front."""
    act_by_s: float | None
    """Process time at which the first one acts unless something was released [s]; None for no such time."""
    named: bool = True
    """Whether recovery has tried the one in front on its twin; else one that serves a limit that trips goes first."""


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
class ThinkingBegan:
    """The process that thinks is there, for the first time or again; what one before it was about to say is lost."""

    kind: ClassVar[str] = "thinking-began"
    process: int
    """Its number."""
    playbook: str = ""
    """Digest of the playbook that it begins with, as it was read; empty for none."""


@dataclass(frozen=True, slots=True)
class ThinkingEnded:
    """The process that thinks is gone; the guard goes on without it."""

    kind: ClassVar[str] = "thinking-ended"
    process: int
    """Its number."""
    reason: str
    """Why, as far as it is known."""


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
