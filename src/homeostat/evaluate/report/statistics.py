"""Statistics of a study: intervals of rates and of mean differences, and the test of paired successes."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from homeostat.process.seeds import Stream, generator

LEVEL: Final = 0.95
"""Confidence of every interval [1]."""
RESAMPLES: Final = 2000
"""Draws of a bootstrap."""
SEED: Final = 20260801
"""Seed of a bootstrap's draws; with it an interval follows from the values alone."""
_AT_ONCE: Final = 250
"""Draws held in memory at the same time."""


@dataclass(frozen=True, slots=True)
class Interval:
    """Confidence interval of ``LEVEL``, in the unit of what it belongs to."""

    low: float
    """Lower end."""
    high: float
    """Upper end."""


@dataclass(frozen=True, slots=True)
class Rate:
    """How often something was so, of all the times that it could have been."""

    count: int
    """Times that it was so."""
    of: int
    """Times that it could have been; at least 1."""
    interval: Interval | None
    """Wilson's interval [1]; None where the times do not stand for themselves, as the questions of one run."""

    @property
    def share(self) -> float:
        """The rate [1]."""
        return self.count / self.of


@dataclass(frozen=True, slots=True)
class Spread:
    """What lies in the middle of some values, and the worst of them."""

    median: float
    """Half of the values are not above it."""
    worst: float
    """The largest value, or the smallest where more is better."""
    n: int
    """Number of values."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean with its interval."""

    mean: float
    """Mean of the values."""
    interval: Interval | None
    """Bootstrap interval; None where one value cannot have one, and where only the mean is known."""


def wilson(count: int, of: int) -> Interval:
    """Wilson's score interval of the rate ``count`` / ``of`` [1]. Wilson 1927; the whole range where ``of`` is 0."""
    if not 0 <= count <= of:
        raise ValueError(f"{count} of {of} is no rate; count must lie in 0 to {of}")
    if of == 0:
        return Interval(0.0, 1.0)
    from scipy.stats import binomtest

    ends = binomtest(count, of).proportion_ci(confidence_level=LEVEL, method="wilson")
    return Interval(float(ends.low), float(ends.high))


def rate(truths: Sequence[bool]) -> Rate | None:
    """How many of independent ``truths`` hold; None where there are none."""
    count = sum(truths)
    return Rate(count, len(truths), wilson(count, len(truths))) if truths else None


def pooled(count: int, of: int) -> Rate | None:
    """A rate of things that are not independent, so that no interval is given; None where there are none."""
    return Rate(count, of, None) if of else None


def mcnemar(only_first: int, only_second: int) -> float:
    """Probability of such discordant pairs if both are equally good [1]; McNemar's exact test (1947), two-sided."""
    if only_first + only_second == 0:
        return 1.0
    from scipy.stats import binomtest

    return float(binomtest(only_first, only_first + only_second, 0.5).pvalue)


def holm(p_values: Sequence[float]) -> list[float]:
    """The same probabilities, adjusted for having looked as many times, in the same order [1]. Holm 1979."""
    adjusted = [0.0] * len(p_values)
    largest = 0.0
    for rank, place in enumerate(sorted(range(len(p_values)), key=lambda i: p_values[i])):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[place]))
        adjusted[place] = largest
    return adjusted


def bootstrap(values: Sequence[float]) -> Interval | None:
    """Interval of the mean of ``values``, in their unit; of differences of pairs, a paired one.

    Bias-corrected and accelerated (Efron 1987) where that can be computed, percentiles elsewhere. None for fewer than
    two values; no width where all are equal, because nothing can be said of values that were not seen.
    """
    if len(values) < 2:
        return None
    data = np.sort(np.asarray(values, dtype=np.float64))
    if data[0] == data[-1]:
        return Interval(float(data[0]), float(data[0]))
    from scipy.stats import bootstrap as resample

    for method in ("BCa", "percentile"):
        with warnings.catch_warnings():
            # Where the first method cannot be computed, it says so in a warning and gives no number.
            warnings.simplefilter("ignore")
            draws = generator(SEED, Stream.STUDY_BOOTSTRAP)
            found = resample(
                (data,),
                np.mean,
                n_resamples=RESAMPLES,
                batch=_AT_ONCE,
                confidence_level=LEVEL,
                method=method,
                rng=draws,
            )
        ends = found.confidence_interval
        if np.isfinite(ends.low) and np.isfinite(ends.high):
            break
    return Interval(float(ends.low), float(ends.high))


def estimate(values: Sequence[float]) -> Estimate | None:
    """Mean of ``values`` with its interval; None where there are none."""
    return Estimate(float(np.mean(np.sort(values))), bootstrap(values)) if values else None


def spread(values: Sequence[float], *, more_is_better: bool = False) -> Spread | None:
    """Median and worst of ``values``; None where there are none."""
    if not values:
        return None
    worst = min(values) if more_is_better else max(values)
    return Spread(float(np.median(values)), float(worst), len(values))


def quantile(values: Sequence[float], share: float) -> float:
    """Value that ``share`` [1] of ``values`` do not exceed, interpolated; ``values`` must not be empty."""
    return float(np.quantile(np.asarray(values, dtype=np.float64), share))
