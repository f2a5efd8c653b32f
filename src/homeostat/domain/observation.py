"""What guard and recovery tell each other: observations one way, messages the other."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from homeostat.domain.alarm import Priority
from homeostat.domain.mode import Mode, PersonCommand
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.request import Answer, Request
from homeostat.domain.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class Observation:
    """One tick of the guard as recovery sees it."""

    now_s: float
    """Process time of the tick [s]."""
    snapshot: Snapshot | None
    """Readings with their quality; None where no sample came."""
    state: str
    """State of the supervisory state machine."""
    rest: ActionSet
    """What is left of the sequence; its immediate commands are those whose ramp goes on."""
    way: RecoveryPath | None
    """The path that is left; None where nothing waits."""
    refused: str | None
    """Why the next step is not taken although its guard holds; None where nothing is in its way."""
    entered: tuple[tuple[str, float], ...]
    """States that were entered in this tick, each with its process time [s]."""
    latched: str | None
    """Why the fallback acted; None while it has not."""
    mode: Mode
    """Mode of the plant."""
    answers: tuple[Answer, ...]
    """Answers that were given in this tick."""
    sample: Snapshot | None
    """What the instruments said, as it came: a bad reading is evidence all the same; None for none."""
    act_by_s: float | None = None
    """Process time at which a fallback acts unless the guard hears of something better [s]; None for no such time."""
    notes: tuple[str, ...] = ()
    """What people have noted for proposers to read, the latest first."""


@dataclass(frozen=True, slots=True)
class Withdraw:
    """The issuer of a request gives it up."""

    request: str
    """Identifier of the request."""
    reason: str
    """Why."""


@dataclass(frozen=True, slots=True)
class Arm:
    """A ranking of the fallbacks, and perhaps a time by which recovery must have acted.

    Where such a time stands already the earlier one counts, unless this is said ``anew``. What ends it: a request that
    the plant was read to hold, a fallback that acts, the alarm in its place where nobody writes, and
    :class:`NoAction`. Thinking again does not.
    """

    strategies: tuple[str, ...]
    """Names of strategies, the best first; those that are left out follow in the order of the tables."""
    act_by_s: float | None = None
    """Process time at which the first strategy acts unless the guard hears of something better [s]; None: not named."""
    tried: bool = True
    """Whether the strategies were tried on a twin; else one that serves a limit that trips goes before the first."""
    anew: bool = False
    """Whether this time takes the place of one that stands: a wait that was as safe as falling back is over."""


@dataclass(frozen=True, slots=True)
class NoAction:
    """Recovery has looked at the plant as it is and decided that nothing is to be written: no time to act by stands."""


@dataclass(frozen=True, slots=True)
class Correction:
    """What a diagnosis says about instruments."""

    errors: tuple[Mapping[str, float], ...]
    """Per likely explanation: tag -> reading minus truth, in the tag's unit; empty takes readings as they are."""


@dataclass(frozen=True, slots=True)
class FallBack:
    """Recovery has nothing to release and wants the fallback, which acts in closed loop and is an alarm elsewhere."""

    reason: str
    """Why."""


@dataclass(frozen=True, slots=True)
class Trouble:
    """Somebody beside the guard is broken, or knows of something that a person must know, too."""

    name: str
    """Identifier of the alarm: ``recovery``."""
    cause: str
    """One sentence."""
    priority: Priority = Priority.HIGH
    """How soon a person must respond."""


@dataclass(frozen=True, slots=True)
class Settled:
    """A trouble is over."""

    name: str
    """Identifier of the alarm."""


@dataclass(frozen=True, slots=True)
class StandBack:
    """What writing needs is missing: the mode goes down to observe, and only a person raises it again."""

    reason: str
    """Why."""


Message: TypeAlias = (
    Request | Withdraw | Arm | NoAction | Correction | FallBack | Trouble | Settled | StandBack | PersonCommand
)
