"""Bounds of settings: a finite number between two ends, with its unit and the reason for the ends."""

import math
from typing import Annotated, Final

from pydantic import AfterValidator, ValidationInfo

from homeostat.domain.plant.timing import Timing

DAY_S: Final = 86_400.0
"""One day [s]."""
WEEK_S: Final = 7.0 * DAY_S
"""One week [s]."""
HISTORY: Final = 3_600
"""Readings that the twin keeps, one per tick: no stretch that is replayed may be longer."""
SAME: Final = 1e-6
"""Share of a tick by which a whole number of them may be off [1]."""
LONGEST: Final = 86_400
"""Most ticks of a rollout or of a pause: a day of a plant that is sampled once per second."""


def within(low: float, high: float, unit: str, why: str) -> AfterValidator:
    """A number from ``low`` to ``high`` in ``unit``; ``why`` says where the ends come from. NaN is in no bounds."""

    def check(value: float) -> float:
        if not low <= value <= high:
            raise ValueError(f"{_shown(value)} {unit} is outside {low:.6g} to {high:.6g} {unit}: {why}")
        return value

    return AfterValidator(check)


def ticks(low: float, high: float, why: str, whole: bool = False) -> AfterValidator:
    """A time from ``low`` to ``high`` ticks of the plant whose `Timing` is the context of the validation [s].

    ``whole``: whether it must be a whole number of them.
    """

    def check(value: float, info: ValidationInfo) -> float:
        timing = timing_of(info)
        least, most = low * timing.tick_s, high * timing.tick_s
        if not least <= value <= most:
            raise ValueError(f"{_shown(value)} s is outside {least:.6g} to {most:.6g} s: {why}")
        if whole and abs(timing.at_s(timing.ticks(value)) - value) > SAME * timing.tick_s:
            raise ValueError(f"{_shown(value)} s is no whole number of ticks of {timing.tick_s:g} s; round it")
        return value

    return AfterValidator(check)


def timing_of(info: ValidationInfo) -> Timing:
    """The timing of the plant whose settings are validated; that where nothing is stated without a context."""
    return info.context if isinstance(info.context, Timing) else Timing()


def _shown(value: float) -> str:
    try:
        return f"{value:.6g}"
    except OverflowError:  # a whole number beyond what a float can be
        return "a number of hundreds of digits"


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError(f"{value:.6g} is no finite number")
    return value


Finite = Annotated[float, AfterValidator(_finite)]
"""Any finite number; what the plant says about its tag bounds it further."""
Fraction = Annotated[float, within(0.0, 1.0, "(fraction)", "it is a share or a probability")]
"""From 0 to 1."""
SomeTime = Annotated[float, ticks(0, LONGEST, f"nothing is waited for longer than {LONGEST} ticks")]
"""A waiting time, which may be none [s]."""
Pause = Annotated[
    float, ticks(1, LONGEST, f"there is one sample per tick, and no pause is longer than {LONGEST} ticks")
]
"""Time between two things that are repeated [s]."""
Stretch = Annotated[int | float, ticks(1, HISTORY, f"the twin keeps {HISTORY} readings, one per tick", whole=True)]
"""Stretch of readings that is replayed [s]."""
Rows = Annotated[int, within(1, HISTORY, "readings", f"they are averaged, and the twin keeps {HISTORY}")]
"""How many readings are averaged."""
Horizon = Annotated[int | float, ticks(1, LONGEST, "a rollout is simulated tick by tick", whole=True)]
"""Length of a rollout [s]."""
Stride = Annotated[
    int | float, ticks(1, HISTORY, f"the plant is sampled once per tick, and {HISTORY} are kept", whole=True)
]
"""Every how many seconds a rollout is sampled."""
Draws = Annotated[int, within(1, 1000, "draws", "each draw is one more simulated plant per hypothesis")]
"""How many parameter draws stand for the uncertainty."""
Deviation = Annotated[float, within(0.0, 1e6, "(tag's unit)", "a standard deviation is not negative")]
"""A standard deviation."""
