"""Events of deviations: a plant that does not go as predicted, or not as it should."""

from dataclasses import dataclass
from typing import ClassVar, Self

from homeostat.domain.verdict import Deviation


@dataclass(frozen=True, slots=True)
class Deviated:
    """A batch does not go as predicted: a step is late, early or forbidden."""

    kind: ClassVar[str] = "deviated"
    state: str
    """State that the plant is in."""
    transition: str
    """Transition that is concerned."""
    earliest_s: float
    """Earliest process time at which a member of the prediction took it [s]."""
    latest_s: float
    """Latest one; infinite where a member never took it [s]."""
    reason: str
    """One sentence."""

    @classmethod
    def of(cls, deviation: Deviation, state: str) -> Self:
        """The event of one deviation."""
        return cls(state, deviation.transition, deviation.earliest_s, deviation.latest_s, deviation.reason)


@dataclass(frozen=True, slots=True)
class Strayed:
    """A plant is nearer a hard limit than was predicted with what is held to be wrong; margins in the limit's unit."""

    kind: ClassVar[str] = "strayed"
    limit: str
    """Name of the limit."""
    margin: float
    """Mean of its last margins."""
    least: float
    """Mean of the least margins of any member of the prediction over the same time."""
    reason: str
    """One sentence."""


@dataclass(frozen=True, slots=True)
class Missed:
    """A criterion is missed for as long as its row allows, whatever is wrong: something better is looked for."""

    kind: ClassVar[str] = "missed"
    criterion: str
    """Name of the criterion."""
    margin: float
    """Its mean margin over that time, negative, in ``unit``."""
    unit: str
    """Unit of the margin."""
    over_s: float
    """How long it may be missed [s]."""

    @property
    def reason(self) -> str:
        """One sentence."""
        return f"{self.criterion} is missed by {-self.margin:.3g} {self.unit} on the mean of {self.over_s:g} s"
