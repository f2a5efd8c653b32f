"""What an event is, who takes it, and the two events that every run has; the layers above define their own."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeAlias


class Event(Protocol):
    """Something that happened: a frozen dataclass whose class names its kind.

    Fields hold what `homeostat.journal.encode.encode` takes. A field that depends on the wall clock has a name starting
    with ``wall_``; everything else must be the same whenever the same seed runs again.
    """

    kind: ClassVar[str]
    """Name of the event in the journal: ``attempt``, ``command-released``."""


Subscriber: TypeAlias = Callable[[Event, float], None]
"""Called with each event and the process time at which it happened [s], once it is recorded, in the order of the lines.

What it raises is kept as a trouble of the trace and does not reach the recorder; see `homeostat.journal.listeners`.
"""


class Trace(Protocol):
    """Where everything that happened goes, in order."""

    def record(self, event: Event, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]; any thread may do so.

        Raises TypeError for an event that cannot be encoded, ValueError for a time that is not finite or a closed
        trace, OSError where the line could not be stored whole; in each case nothing is recorded.
        """
        ...

    def sync(self) -> None:
        """Return when everything that was recorded is as safe as the trace can make it."""
        ...

    def subscribe(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event."""
        ...


TICK = "tick_s"
"""Name of the setting that says how often a plant is sampled, where that is not once per second."""
DISTURBANCE = "disturbance "
"""Begin of the names of settings that are disturbances."""
BEGINS_IN = "begins_in"
"""Name of the setting that says in which state of the machine a run begins, where that is not the one by design."""
SETPOINT = "setpoint "
"""Begin of the names of settings that say what an operator had set by then."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One named choice that a run was started with."""

    name: str
    """Name as the command line or the scenario spells it."""
    value: str | float | bool
    """What was chosen, in the unit that the name states."""


@dataclass(frozen=True, slots=True)
class RunStarted:
    """A run begins."""

    kind: ClassVar[str] = "run-started"

    case: str
    """Name of the plant, or of its folder."""
    faults: tuple[str, ...]
    """Faults that the scenario will inject; empty for a run without one."""
    seed: int
    """Seed from which every random draw of the run follows."""
    configuration: tuple[Setting, ...] = ()
    """Everything else that was chosen."""
    versions: tuple[Setting, ...] = ()
    """Versions of the interpreter and of the libraries that compute numbers."""
    wall_started: str = ""
    """Wall-clock time of the start, ISO 8601 with offset."""

    @property
    def settings(self) -> dict[str, str | float | bool]:
        """What else was chosen, by name."""
        return {setting.name: setting.value for setting in self.configuration}

    @property
    def disturbances(self) -> tuple[str, ...]:
        """What else happens to the true plant, as it was asked for."""
        return tuple(str(setting.value) for setting in self.configuration if setting.name.startswith(DISTURBANCE))


@dataclass(frozen=True, slots=True)
class RunFinished:
    """A run ended by itself, well or badly."""

    kind: ClassVar[str] = "run-finished"

    outcome: str
    """How it ended, one word: ``released``, ``handed-over``, ``no-fault``."""
    reason: str = ""
    """Why, one sentence."""
    wall_duration_s: float = 0.0
    """Wall-clock time that the run took [s]."""


@dataclass(frozen=True, slots=True)
class Resumed:
    """A journal that was left is gone on with. What its writer did not sign may have been altered meanwhile."""

    kind: ClassVar[str] = "resumed"

    lines: int
    """Number of whole lines that were found."""
    signed: int
    """How many of them, from the first, the key signs that signs what follows; 0 without a key."""
    torn: bool
    """Whether a torn line was taken away."""
    changed: tuple[Setting, ...] = ()
    """What was chosen or installed that the lines before state otherwise, or do not state."""


@dataclass(frozen=True, slots=True)
class Signed:
    """Every line before this one is vouched for by whoever holds a key. Its time is the one of the line before."""

    kind: ClassVar[str] = "signed"

    key: str
    """Public Ed25519 key, in hexadecimal."""
    lines: int
    """Number of lines that are signed: all that come before."""
    wall_digest: str
    """Digest of the last of them, and so of the whole chain."""
    wall_signature: str
    """Signature over both, in hexadecimal."""
