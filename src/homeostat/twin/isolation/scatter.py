"""Scatter: by how much more a signal's second differences scatter than is usual of it, whatever moves it besides noise.

Compared are mean squares of the smallest differences, of both a larger and a smaller share of them, and the lesser
ratio counts: noise makes every difference larger, a valve that sticks and slips some, and outliers and steps few.
"""

import math
from typing import Final

import numpy as np

from homeostat.process.types import Flags, Table

LEARNED: Final = 60
"""Fewest healthy differences from which it is learned how much an instrument scatters against the model's."""
KEPT: Final = (0.8, 0.5)
"""Shares that count of the differences: the largest are outliers, steps and kinks of ramps."""

_USUAL = (0.4, 9.0)  # mean square scatter of an instrument against the model's: correlated noise has 0.5
_COMMANDED = 1.5  # how much of the scatter that follows from commands is taken off: lags are known to some 10 %


def against_usual(own: Table, alike: Table, healthy: Flags, present: Flags) -> float:
    """Root mean square scatter of the ``present`` differences against what is usual [1].

    ``own``: what was read, shape (1, times); ``alike``: what the model's instruments show in the same ticks, the first
    row without noise, shape (members, times); ``healthy``: where it is learned what is usual of this one.
    """
    return min(_ratio(own, alike, healthy, present, share) for share in KEPT)


def _ratio(own: Table, alike: Table, healthy: Flags, present: Flags, share: float) -> float:
    factor = 1.0
    if np.count_nonzero(healthy) >= LEARNED:
        commanded, noise = _of_model(alike[:, healthy], share)
        if noise > commanded / 2.0:
            shown = (_mean_square(own[:, healthy], share) - commanded) / noise
            if shown < _USUAL[0] and share != KEPT[0]:  # most of what a coarse instrument shows is no difference at all
                return math.inf
            factor = float(np.clip(shown, *_USUAL))
    commanded, noise = _of_model(alike[:, present], share)
    left = max(_mean_square(own[:, present], share) - _COMMANDED * commanded, 0.0)
    return math.sqrt(left / (factor * noise)) if noise > 0.0 else 0.0


def _of_model(alike: Table, share: float) -> tuple[float, float]:
    """Mean squares of the model's differences by commands alone, and by noise alone."""
    return _mean_square(alike[:1], share), _mean_square(alike[1:] - alike[:1], share)


def _mean_square(differences: Table, share: float) -> float:
    """Mean square of that share of each row's differences, the smallest."""
    sizes = np.sort(np.abs(differences), axis=1)[:, : int(share * differences.shape[1])]
    return float(np.mean(sizes**2))
