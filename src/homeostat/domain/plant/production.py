"""What production is, and how much of it a plant is designed for."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Production:
    """The quantity that a recovery should keep up."""

    throughput: str
    """Tag whose mean is the production rate."""
    design_rate: float
    """Its value by design, in the tag's unit."""
    per_s: float = 1.0
    """Time in which so much is made: 1 for a tag that is a rate per second, a batch's time for an amount [s]."""

    def made(self, seconds: float) -> float:
        """What is made in so many ``seconds`` by design, in the unit of the product."""
        return self.design_rate * seconds / self.per_s
