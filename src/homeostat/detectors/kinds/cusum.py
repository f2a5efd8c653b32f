"""CUSUM: what each signal's deviations add up to, upwards and downwards (Page, 1954)."""

from collections.abc import Sequence
from typing import Final, final

import numpy as np

from homeostat.detectors.detector import Learned, Values

SLACK: Final = 0.5
"""Deviation that adds nothing [standard deviations]: half the shift of one that is looked for (Montgomery)."""


@final
class Cusum:
    """One statistic per signal: the larger of its two sums [standard deviations].

    It returns slowly after a long fault.
    """

    name = "cusum"

    def learn(self, runs: Sequence[Values]) -> Learned:
        """Nothing beyond the mean and the standard deviation, which the rows have already been scaled by."""
        return _Sums()


@final
class _Sums:
    def statistics(self, rows: Values) -> Values:
        return np.maximum(_above(rows - SLACK), _above(-rows - SLACK))


def _above(steps: Values) -> Values:
    """Sums of ``steps`` that are never below zero: how far each sum is above the least one before it, or zero."""
    sums = np.cumsum(steps, axis=0)
    above: Values = sums - np.minimum(np.minimum.accumulate(sums, axis=0), 0.0)
    return above
