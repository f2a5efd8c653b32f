"""The plant's own time: how often it is sampled, and how long it takes to respond."""

import math
from dataclasses import dataclass
from typing import Final, Self

TICK_S: Final = 1.0
"""Time between two samples where the settings state none [s]."""
REFERENCE_S: Final = 250.0
"""The response of the plant that reference times are meant for [s]."""
RESPONSE_TICKS: Final = 250.0
"""A plant responds in so many ticks at least; it is sampled more often than that only to see its noise [1]."""
_DIGITS: Final = 9
"""Decimal places of a time [s]: what a sum of ticks is off by is less."""


@dataclass(frozen=True, slots=True)
class Timing:
    """How fast one plant is.

    A time that nobody states is given for a plant that responds in `REFERENCE_S`, and stretched by how much slower or
    faster this one is. Check: 900 s become 54,000 s for a plant that responds in 15,000 s.
    """

    tick_s: float = TICK_S
    """Time between two samples [s]."""
    response_s: float = REFERENCE_S
    """How long its slowest loop takes to respond [s]."""

    @classmethod
    def of(cls, tick_s: float, resets_s: tuple[float, ...] = (), stated_s: float | None = None) -> Self:
        """The timing of a plant with this tick, whose loops have these reset times, unless its response is stated."""
        return cls(tick_s, stated_s or max(RESPONSE_TICKS * tick_s, *resets_s, 0.0))

    @property
    def stretch(self) -> float:
        """How many times slower than the reference the plant is [1]."""
        return self.response_s / REFERENCE_S

    def time_s(self, reference_s: float) -> float:
        """What ``reference_s`` is for this plant, in whole ticks and at least one, unless it is nothing or for ever."""
        if reference_s <= 0.0 or math.isinf(reference_s):
            return reference_s
        return self.at_s(max(round(reference_s * self.stretch / self.tick_s), 1))

    def times_s(self, reference_s: tuple[float, ...]) -> tuple[float, ...]:
        """The same of several times."""
        return tuple(map(self.time_s, reference_s))

    def at_s(self, tick: float) -> float:
        """Process time after so many ticks [s]; no rounding adds up."""
        return round(tick * self.tick_s, _DIGITS)

    def told(self, at_s: float) -> str:
        """A time for people, without its unit: with decimals where ticks are shorter than a second."""
        return f"{at_s:.{max(math.ceil(-math.log10(self.tick_s)), 0)}f}"

    def sampling_s(self, every_s: float | None) -> float:
        """Time between two samples of an instrument that takes one every ``every_s`` [s], in whole ticks [s].

        That of a tick where it states none.
        """
        return self.at_s(max(self.ticks(every_s or 0.0), 1))

    def ticks(self, seconds: float) -> int:
        """How many ticks ``seconds`` are, to the nearest."""
        return round(seconds / self.tick_s)

    def whole_ticks(self, seconds: float) -> int:
        """How many ticks are over after ``seconds``."""
        return math.floor(seconds / self.tick_s + 10.0**-_DIGITS)


REFERENCE: Final = Timing()
"""That of a plant that states nothing, with loops that are no slower."""
