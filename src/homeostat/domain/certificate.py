"""Certificate: what so many rollouts say about the probability that a hard limit is violated."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Certificate:
    """A bound that holds whenever the drawing stopped, and whatever it stopped for."""

    draws: int
    """Rollouts that were drawn, each with a hypothesis and parameters of its own."""
    violations: int
    """Those in which a hard limit is violated."""
    bound: float
    """Upper bound of the probability of a violation, as far as twin and hypotheses are true [1]."""
    level: float
    """Confidence with which it holds [1]."""
