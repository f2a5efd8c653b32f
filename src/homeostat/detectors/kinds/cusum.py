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
        found = np.empty_like(rows)
        up, down = np.zeros(rows.shape[1]), np.zeros(rows.shape[1])
        for k, row in enumerate(rows):
            up = np.maximum(0.0, up + row - SLACK)
            down = np.maximum(0.0, down - row - SLACK)
            found[k] = np.maximum(up, down)
        return found
