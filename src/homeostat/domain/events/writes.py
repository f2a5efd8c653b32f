"""What is written to a plant and what comes of it, as the guard journals it."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

from homeostat.domain.recovery import Command


class Cause(StrEnum):
    """On whose behalf something is written."""

    FALLBACK = "fallback"
    REQUEST = "request"
    SEQUENCE = "sequence"
    PERSON = "person"


class WriteResult(StrEnum):
    """What became of one attempt to write."""

    ACCEPTED = "accepted"
    """The link took it."""
    FAILED = "failed"
    """The link refused it or broke."""
    TIMED_OUT = "timed-out"
    """The link did not answer in time."""
    GIVEN_UP = "given-up"
    """A trip, a mode change or a person overtook it on the wire."""


@dataclass(frozen=True, slots=True)
class StepLoaded:
    """One later step of what the sequencer has loaded."""

    transition: str
    """Name of the transition that it takes."""
    commands: tuple[Command, ...]
    """What is sent when it is due."""


@dataclass(frozen=True, slots=True)
class WriteIntended:
    """Commands are about to be sent to the plant."""

    kind: ClassVar[str] = "write-intended"
    write: int
    """Number of the write."""
    attempt: int
    """Number of the attempt at it, from 1."""
    cause: Cause
    """On whose behalf."""
    source: str
    """Name of the request, strategy, transition or person."""
    commands: tuple[Command, ...]
    """What is sent, in order."""
    digest: str
    """Digest of the action set that they begin; empty where they are a later step's or a person's."""
    state: str
    """State of the machine that they lead to."""
    steps: tuple[StepLoaded, ...] = ()
    """What follows once the plant has taken them, in order."""


@dataclass(frozen=True, slots=True)
class WriteEnded:
    """One attempt to write has an outcome."""

    kind: ClassVar[str] = "write-ended"
    write: int
    """Number of the write."""
    attempt: int
    """Number of the attempt."""
    result: WriteResult
    """What became of it."""
    detail: str = ""
    """What the link said."""


@dataclass(frozen=True, slots=True)
class ReadBack:
    """The plant was read after a write."""

    kind: ClassVar[str] = "read-back"
    write: int
    """Number of the write."""
    confirmed: tuple[str, ...]
    """Tags whose target the plant has accepted."""
    deviating: tuple[str, ...] = ()
    """Tags whose target it has not."""


@dataclass(frozen=True, slots=True)
class LeaseLost:
    """The plant does not take the guard's commands any more; its own control may have taken over."""

    kind: ClassVar[str] = "lease-lost"
    reason: str
    """How that was noticed."""


@dataclass(frozen=True, slots=True)
class LeaseTried:
    """The guard has tried to have a lost lease again."""

    kind: ClassVar[str] = "lease-tried"
    attempt: int
    """Number of the attempt, from 1; it goes on counting where the lease is lost again soon."""
    given: bool
    """Whether the plant has given it."""
    reason: str = ""
    """Why not."""


@dataclass(frozen=True, slots=True)
class TargetsHeld:
    """Targets that the plant holds from now on without a write that says so: as found, or moved by somebody else."""

    kind: ClassVar[str] = "targets-held"
    targets: Mapping[str, float | None]
    """Writable tag -> its target in the tag's unit; None for automatic."""
