"""What production is, and how much of it a plant is designed for."""

from dataclasses import dataclass
from typing import Final

MADE: Final = "made so far"
"""Signal of a rollout: what it has made since the present moment, in the unit of the product; no tag has a space."""


@dataclass(frozen=True, slots=True)
class Production:
    """The quantity that a recovery should keep up."""

    throughput: str
    """Tag whose mean is the production rate."""
    design_rate: float
    """Its value by design, in the tag's unit."""
    per_s: float = 1.0
    """Time in which so much is made: 1 for a tag that is a rate per second, a batch's time for an amount [s]."""
    delivered: tuple[str, ...] = ()
    """True quantities whose sum is what was made so far; empty where the throughput counts by itself."""

    def made(self, seconds: float) -> float:
        """What is made in so many ``seconds`` by design, in the unit of the product."""
        return self.design_rate * seconds / self.per_s
