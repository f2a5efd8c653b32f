"""What the twin foresees, as the journal has it: bands of what is limited, and times until limits are violated."""

from dataclasses import dataclass
from typing import ClassVar

from homeostat.domain.certificate import Certificate


@dataclass(frozen=True, slots=True)
class ForeseenBand:
    """Between what one tag lies in all members of a rollout, interval by interval."""

    tag: str
    """Tag, in whose unit the values are."""
    low: tuple[float, ...]
    """Least value in each interval, over all members."""
    high: tuple[float, ...]
    """Largest one."""


@dataclass(frozen=True, slots=True)
class Reached:
    """When members of a rollout first violate something; only those that do have a time."""

    limit: str
    """Name of the limit; empty for whichever hard limit is the first."""
    members: int
    """Members that violate it within the time that the twin looks ahead."""
    probability: float
    """What these members are worth together [0, 1]."""
    earliest_s: float
    """First time in any member, seconds after the rollout begins [s]."""
    middle_s: float
    """Median of the times, each weighted as its member [s]."""
    latest_s: float
    """Last of the times [s]."""


@dataclass(frozen=True, slots=True)
class Foreseen:
    """What the twin says that the plant will do, left alone or with what is about to be released."""

    kind: ClassVar[str] = "foreseen"
    digest: str
    """Digest of the action set; empty for what happens if nothing is done."""
    from_s: float
    """Process time at which the rollout begins [s]."""
    length_s: float
    """How far it looks ahead [s]; what is not violated until then may be violated later."""
    members: int
    """Members of the rollout; 0 where the twin could not say, and ``note`` says why."""
    ends_s: tuple[float, ...] = ()
    """Where each interval ends, seconds after the beginning [s]; one begins where the one before it ends."""
    bands: tuple[ForeseenBand, ...] = ()
    """Of every tag that a limit compares."""
    first: Reached | None = None
    """When the first hard limit trips; None where none does."""
    reached: tuple[Reached, ...] = ()
    """The same of each limit that any member violates, the first one first."""
    note: str = ""
    """Why the twin cannot say; empty where it can."""
    certificate: Certificate | None = None
    """How likely what is about to be released is to violate a hard limit; None for what happens if nothing is done."""
