"""Three-sigma: each signal against its own mean and standard deviation (Shewhart, 1931)."""

from collections.abc import Sequence
from typing import final

import numpy as np

from homeostat.detectors.detector import Learned, Values


@final
class ThreeSigma:
    """One statistic per signal: its distance from its mean in standard deviations.

    The limit need not be three: it is the one that gives the stated rate of false alarms.
    """

    name = "three-sigma"

    def learn(self, runs: Sequence[Values]) -> Learned:
        """Nothing beyond the mean and the standard deviation, which the rows have already been scaled by."""
        return _Distances()


@final
class _Distances:
    def statistics(self, rows: Values) -> Values:
        return np.abs(rows)
