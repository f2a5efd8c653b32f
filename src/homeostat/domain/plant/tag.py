"""Tags: the named signals of a plant (ISA-5.1 roles, units, ranges)."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

ROUNDING = 1e-9
"""Share of a range by which what was written down may be off."""


class Role(StrEnum):
    """What a signal is to the control system (ISA-5.1)."""

    PV = "PV"
    """Process value: measured."""
    SP = "SP"
    """Setpoint: what a loop is asked to hold."""
    MV = "MV"
    """Manipulated value: what a controller or an operator commands an actuator to do."""
    STATUS = "STATUS"
    """State of equipment, for example the position of a valve."""


@dataclass(frozen=True, slots=True)
class Range:
    """A closed interval of a tag's values."""

    low: float
    """Lower end in the tag's unit."""
    high: float
    """Upper end in the tag's unit."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise ValueError(f"range [{self.low!r}, {self.high!r}] must be finite with low < high")

    @property
    def span(self) -> float:
        """Width of the interval in the tag's unit."""
        return self.high - self.low

    def contains(self, value: float) -> bool:
        """Whether ``value`` is finite and lies inside, ends included."""
        return self.low <= value <= self.high

    def clip(self, value: float) -> float:
        """The nearest value inside the interval."""
        return min(max(value, self.low), self.high)


@dataclass(frozen=True, slots=True)
class Tag:
    """One named signal of the plant."""

    name: str
    """Name as formulas use it: ``T1``, ``T1.sp``, ``V2.pos``."""
    role: Role
    """What the signal is to the control system."""
    unit: str
    """Unit symbol; ``1`` for a fraction."""
    range: Range
    """Instrument or setpoint range, in the unit."""
    scale: float
    """What counts as one unit of margin when a formula mixes units, in the tag's unit; > 0."""
    description: str = ""
    """What it is, in the words of the signal list."""
    rate_limit: float | None = None
    """Fastest admissible ramp for SP and MV tags, in unit per second; None where no limit applies."""
    increment: float | None = None
    """Step in which SP and MV tags are set by hand, in the unit; None where any value may be set. One as wide as the
    range of a manipulated value gives it two positions."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.scale) and self.scale > 0):
            raise ValueError(f"tag {self.name!r}: scale {self.scale!r} must be finite and > 0 {self.unit}")
        if self.rate_limit is not None and not math.isfinite(self.rate_limit):
            raise ValueError(f"tag {self.name!r}: rate limit {self.rate_limit!r} must be finite, in {self.unit}/s")
        if self.increment is not None and not (math.isfinite(self.increment) and self.increment > 0):
            raise ValueError(f"tag {self.name!r}: increment {self.increment!r} must be finite and > 0 {self.unit}")

    @property
    def two_position(self) -> bool:
        """Whether it is at one end of its range or at the other, as a valve that opens or closes."""
        step = 0.0 if self.increment is None else self.increment
        return self.role is Role.MV and step >= self.range.span * (1.0 - ROUNDING)

    def nearest(self, value: float) -> float:
        """What can be commanded next to ``value``: of two positions the nearer one, the higher one in the middle."""
        if not self.two_position:
            return value
        return self.range.low if value - self.range.low < self.range.high - value else self.range.high


def scales_of(tags: Iterable[Tag]) -> dict[str, float]:
    """Unit -> what counts as one unit of margin in it: the smallest scale of its ``tags``; 1 for mixed formulas."""
    found: dict[str, float] = {}
    for tag in tags:
        found[tag.unit] = min(found.get(tag.unit, tag.scale), tag.scale)
    return found | {"1": 1.0}
