"""How a quantity grows with the size of the plant: the exponent of a power law, with its confidence interval."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats


@dataclass(frozen=True)
class Growth:
    """Slope of log(value) against log(modules): 0 for independent of the size, 1 for proportional to it."""

    exponent: float
    """The slope [1]."""
    half_width: float
    """Half of its 95 % confidence interval [1]."""
    points: int
    """Values that were fitted."""

    def __str__(self) -> str:
        """Slope with its interval."""
        return f"{self.exponent:+.3f} ± {self.half_width:.3f}"


def growth(modules: Sequence[int], values: Sequence[float], series: Sequence[Hashable]) -> Growth:
    """The common exponent of several series of values, each with a factor of its own.

    ``series`` names the one that each value belongs to, for example its scenario: what sets series apart is no growth.
    Least squares on logarithms, with one degree of freedom less per series and one for the slope. Hand check: 1, 2, 4
    at 1, 2, 4 modules in one series have exponent 1 and no width.
    """
    x, y, names = np.log(modules), np.log(values), list(dict.fromkeys(series))
    for name in names:
        mine = np.array([s == name for s in series])
        x[mine] -= x[mine].mean()
        y[mine] -= y[mine].mean()
    freedom, spread = len(x) - len(names) - 1, float(x @ x)
    if freedom < 1 or spread == 0.0:
        raise ValueError(f"{len(x)} values in {len(names)} series do not tell a slope; measure more sizes")
    slope = float(x @ y) / spread
    error = math.sqrt(max(float(np.sum((y - slope * x) ** 2)), 0.0) / freedom / spread)
    return Growth(slope, float(stats.t.ppf(0.975, freedom)) * error, len(x))
