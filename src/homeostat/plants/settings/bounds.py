"""Bounds of settings: a finite number between two ends, with its unit and the reason for the ends."""

import math
from typing import Annotated, Final

from pydantic import AfterValidator

DAY_S: Final = 86_400.0
"""One day [s]."""
WEEK_S: Final = 7.0 * DAY_S
"""One week [s]."""
HISTORY_S: Final = 3_600
"""Readings that the twin keeps, one per second: no stretch that is replayed may be longer [s]."""


def within(low: float, high: float, unit: str, why: str) -> AfterValidator:
    """A number from ``low`` to ``high`` in ``unit``; ``why`` says where the ends come from. NaN is in no bounds."""

    def check(value: float) -> float:
        if not low <= value <= high:
            raise ValueError(f"{_shown(value)} {unit} is outside {low:.6g} to {high:.6g} {unit}: {why}")
        return value

    return AfterValidator(check)


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
SomeTime = Annotated[float, within(0.0, DAY_S, "s", "nothing is waited for longer than a day")]
"""A waiting time, which may be none [s]."""
Pause = Annotated[float, within(1.0, DAY_S, "s", "there is one sample per second, and no pause is longer than a day")]
"""Time between two things that are repeated [s]."""
Stretch = Annotated[int, within(1, HISTORY_S, "s", "the twin keeps an hour of readings, one per second")]
"""Stretch of readings that is replayed [s]."""
Rows = Annotated[int, within(1, HISTORY_S, "readings", "they are averaged, and the twin keeps an hour")]
"""How many readings are averaged."""
Horizon = Annotated[int, within(1, int(DAY_S), "s", "a rollout is simulated second by second")]
"""Length of a rollout [s]."""
Stride = Annotated[int, within(1, 3600, "s", "the plant is sampled once per second, and an hour has to be seen")]
"""Every how many seconds a rollout is sampled."""
Draws = Annotated[int, within(1, 1000, "draws", "each draw is one more simulated plant per hypothesis")]
"""How many parameter draws stand for the uncertainty."""
Deviation = Annotated[float, within(0.0, 1e6, "(tag's unit)", "a standard deviation is not negative")]
"""A standard deviation."""
