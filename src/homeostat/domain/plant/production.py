"""What production is, and how much of it a plant is designed for."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Production:
    """The quantity that a recovery should keep up."""

    throughput: str
    """Tag whose mean is the production rate."""
    design_rate: float
    """Its value by design, in the tag's unit."""
