"""Certificate: what so many rollouts say about the probability that a hard limit is violated, or more than need be."""

import math
from dataclasses import dataclass
from typing import Final

VIOLATE: Final = "violate a hard limit"
"""What is counted where nothing is compared with the fallback."""


@dataclass(frozen=True, slots=True)
class Certificate:
    """A bound that holds whenever the drawing stopped, and whatever it stopped for."""

    draws: int
    """Rollouts that were drawn, each with a hypothesis and parameters of its own."""
    violations: int
    """Those in which a hard limit is violated, or with :attr:`beside` those that do worse than the fallback."""
    bound: float
    """Upper bound of the probability of one, as far as twin and hypotheses are true [1]."""
    level: float
    """Confidence with which it holds [1]."""
    beside: bool = False
    """Whether the fallback violates a limit as well, so that only what does worse than it is counted."""

    @property
    def percent(self) -> str:
        """:attr:`bound` in percent, to two digits where it is small, and never rounded to less than it is."""
        share = 100.0 * self.bound
        digits = 1 if share >= 1.0 or share <= 0.0 else 1 - math.floor(math.log10(share))
        return f"{math.ceil(share * 10.0**digits - 1e-9) / 10.0**digits:.{digits}f}"

    @property
    def told(self) -> str:
        """What :attr:`violations` of the draws do, in words."""
        return "do worse than the fallback, which violates a hard limit as well" if self.beside else VIOLATE
