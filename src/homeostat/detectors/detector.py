"""What a detector is: it learns from fault-free rows, and says of each later row how strange it is."""

from collections.abc import Sequence
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

Values: TypeAlias = NDArray[np.float64]


class Learned(Protocol):
    """What a detector knows after it has learned."""

    def statistics(self, rows: Values) -> Values:
        """How strange each row is by each statistic, shape (rows, statistics) [1]: finite, never negative.

        ``rows``: consecutive rows, shape (rows, signals), as a detector learns from. Larger is stranger. What is said
        of a row depends on it and on rows before it, never on later ones.
        """
        ...


class Detector(Protocol):
    """A way to tell strange rows. Equal rows and equal seed teach the same, to the last digit."""

    @property
    def name(self) -> str:
        """What people call it."""
        ...

    def learn(self, runs: Sequence[Values]) -> Learned:
        """Learn from fault-free ``runs``, each of consecutive rows, shape (rows, signals).

        Each signal has mean 0 and standard deviation 1 over all runs together. The number of statistics depends on the
        number of signals alone.
        """
        ...
