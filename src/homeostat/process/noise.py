"""Counter-based noise: the value depends on (seed, tick, channel) alone, never on the order of drawing.

So a snapshot of a running plant needs no generator state, members can run on any thread, and two rollouts
with the same seed see the same disturbances (common random numbers).
"""

import math

import numpy as np

from homeostat.process.compiled import compiled


@compiled
def uniform(seed: int, tick: int, channel: int) -> float:
    """A number in (0, 1) from the SplitMix64 mix of seed, tick and channel (Steele, Lea, Flood 2014)."""
    # Channels come in pages of 64, each with a seed of its own, so that there may be any number of them.
    page = np.uint64(0xD1B54A32D192ED03) * np.uint64(channel >> 6)
    z = np.uint64(seed) + page + np.uint64(0x9E3779B97F4A7C15) * np.uint64(tick * 64 + (channel & 63) + 1)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    # 52 bits and a half: with 53 bits the largest would round to 1.
    return (float(z >> np.uint64(12)) + 0.5) * (1.0 / 4503599627370496.0)


@compiled
def normal(seed: int, tick: int, channel: int) -> float:
    """A standard normal number by inversion."""
    return quantile(uniform(seed, tick, channel))


@compiled
def quantile(p: float) -> float:
    """Quantile of the standard normal distribution (Acklam's rational approximation, relative error 1.2e-9)."""
    # fmt: off
    if p < 0.02425 or p > 0.97575:
        q = math.sqrt(-2.0 * math.log(min(p, 1.0 - p)))
        c = (
            ((((-7.784894002430293e-03 * q - 3.223964580411365e-01) * q - 2.400758277161838) * q - 2.549732539343734)
             * q + 4.374664141464968) * q + 2.938163982698783
        ) / ((((7.784695709041462e-03 * q + 3.224671290700398e-01) * q + 2.445134137142996) * q + 3.754408661907416)
             * q + 1.0)
        return c if p < 0.5 else -c
    q = p - 0.5
    r = q * q
    return (
        (((((-3.969683028665376e01 * r + 2.209460984245205e02) * r - 2.759285104469687e02) * r
           + 1.383577518672690e02) * r - 3.066479806614716e01) * r + 2.506628277459239) * q
    ) / (((((-5.447609879822406e01 * r + 1.615858368580409e02) * r - 1.556989798598866e02) * r
           + 6.680131188771972e01) * r - 1.328068155288572e01) * r + 1.0)
    # fmt: on
