"""Counter-based noise: uniform, normal, independent, and equal wherever and in whatever order it is drawn."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.process import noise
from homeostat.process.compiled import machine_code

N = 40_000
WORD = (1 << 64) - 1
GOLDEN = 0x9E3779B97F4A7C15
SEEDS = st.integers(-(2**63), 2**63 - 1)


uniform, normal = machine_code(noise.uniform), machine_code(noise.normal)


def seed_for(z: int) -> int:
    """The seed whose mix at second 0, channel 0 is the 64 bits ``z``: SplitMix64 backwards."""
    z ^= (z >> 31) ^ (z >> 62)
    z = z * pow(0x94D049BB133111EB, -1, 1 << 64) & WORD
    z ^= (z >> 27) ^ (z >> 54)
    z = z * pow(0xBF58476D1CE4E5B9, -1, 1 << 64) & WORD
    z ^= (z >> 30) ^ (z >> 60)
    seed = (z - GOLDEN) & WORD
    return seed - (1 << 64) if seed >> 63 else seed


def draws(function: object, seeds: object, seconds: object, channels: object) -> np.ndarray:
    """Values over broadcast arguments, flat."""
    grid = np.broadcast_arrays(*(np.atleast_1d(np.asarray(a, dtype=np.int64)) for a in (seeds, seconds, channels)))
    return np.array([function(s, t, c) for s, t, c in zip(*(g.ravel() for g in grid), strict=True)])  # type: ignore[operator]


def mix(seed: int, second: int, channel: int) -> int:
    """SplitMix64 as published, with Python's integers."""
    z = (seed + GOLDEN * (second * 64 + channel + 1)) & WORD
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 & WORD
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB & WORD
    return z ^ (z >> 31)


@given(SEEDS, st.integers(0, 10**7), st.integers(0, 63))
def test_the_bits_are_those_of_splitmix64(seed: int, second: int, channel: int) -> None:
    assert uniform(seed, second, channel) == ((mix(seed, second, channel) >> 12) + 0.5) / 2.0**52
    with np.errstate(over="ignore"):
        assert noise.uniform(np.int64(seed), second, channel) == uniform(seed, second, channel)
        assert noise.normal(np.int64(seed), second, channel) == pytest.approx(normal(seed, second, channel), rel=1e-14)


def test_splitmix64_has_its_published_first_values() -> None:
    """First outputs of the reference implementation for the seed 1234567."""
    assert [mix(1234567, 0, k) for k in range(3)] == [6457827717110365317, 3203168211198807973, 9817491932198370423]


@given(st.integers(0, WORD))
def test_the_test_can_choose_the_bits(z: int) -> None:
    assert mix(seed_for(z), 0, 0) == z


@pytest.mark.parametrize("z", [0, 1, WORD, WORD - 1, 1 << 63, (1 << 63) - 1])
def test_the_ends_are_inside_the_interval(z: int) -> None:
    seed = seed_for(z)
    assert 0.0 < uniform(seed, 0, 0) < 1.0
    assert math.isfinite(normal(seed, 0, 0)) and abs(normal(seed, 0, 0)) < 8.3


def inverse(p: float) -> float:
    return NormalDist().inv_cdf(p)


def test_the_normal_is_the_inverse_of_the_uniform() -> None:
    for k in range(20_000):
        assert normal(5, k, 0) == pytest.approx(inverse(uniform(5, k, 0)), rel=2e-9, abs=2e-9)


@given(st.integers(0, WORD))
def test_the_normal_is_the_inverse_of_the_uniform_anywhere(z: int) -> None:
    seed = seed_for(z)
    assert normal(seed, 0, 0) == pytest.approx(inverse(uniform(seed, 0, 0)), rel=2e-9, abs=2e-9)


@pytest.mark.parametrize("exponent", [-52, -40, -30, -20, -10, -6, -5, -3, -2])
@pytest.mark.parametrize("upper", [False, True])
def test_the_normal_is_right_in_both_tails(exponent: int, upper: bool) -> None:
    z = round(2.0**exponent * 2.0**64)
    seed = seed_for(WORD - z if upper else z)
    p = uniform(seed, 0, 0)
    assert normal(seed, 0, 0) == pytest.approx(inverse(p), rel=2e-9)
    assert (normal(seed, 0, 0) > 0.0) == upper


@pytest.mark.parametrize("p", [0.02425, 0.97575])
def test_the_two_formulas_of_the_inverse_meet(p: float) -> None:
    z = round(p * 2.0**64)
    step = 1 << 14
    below, above = normal(seed_for(z - step), 0, 0), normal(seed_for(z + step), 0, 0)
    assert below <= above + 1e-9 and above - below < 1e-8


STREAMS = {
    "seconds": (1, np.arange(N), 0),
    "channels": (1, np.arange(N // 13)[:, None], np.arange(13)),
    "small seeds": (np.arange(N), 7, 3),
    "multiplied seeds": (np.arange(N) * 7919 + 13, 2000, 12),
    "random seeds": (np.random.default_rng(0).integers(1, 2**62, N), 4321, 1),
}


@pytest.mark.parametrize("stream", STREAMS)
def test_uniform_along(stream: str) -> None:
    """Kolmogorov and Smirnov at 0.1 %."""
    u = np.sort(draws(uniform, *STREAMS[stream]))
    n = len(u)
    steps = np.arange(1, n + 1) / n
    assert max(np.max(steps - u), np.max(u - steps + 1.0 / n)) < 1.95 / math.sqrt(n)


@pytest.mark.parametrize("stream", STREAMS)
def test_standard_normal_along(stream: str) -> None:
    """Mean, variance, skewness and kurtosis within four standard errors."""
    z = draws(normal, *STREAMS[stream])
    n = len(z)
    assert abs(z.mean()) < 4.0 / math.sqrt(n)
    assert abs(z.var() - 1.0) < 4.0 * math.sqrt(2.0 / n)
    assert abs(np.mean(z**3)) < 4.0 * math.sqrt(15.0 / n)
    assert abs(np.mean(z**4) - 3.0) < 4.0 * math.sqrt(96.0 / n)


def test_channels_seconds_and_seeds_are_independent() -> None:
    """Correlations of neighbours, also of squares, within 4.5 standard errors (about sixty of them)."""
    n = 10_000
    base = draws(normal, 11, np.arange(n), 0)
    neighbours = {
        **{f"channel {c}": draws(normal, 11, np.arange(n), c) for c in range(1, 13)},
        **{f"{k} seconds later": draws(normal, 11, np.arange(n) + k, 0) for k in (1, 2, 3, 10, 60)},
        **{f"seed +{d}": draws(normal, 11 + d, np.arange(n), 0) for d in (1, 2, 13, 7919, 2**32, 2**62)},
    }
    for name, other in neighbours.items():
        for power in (1, 2):
            r = np.corrcoef(base**power, other**power)[0, 1]
            assert abs(r) < 4.5 / math.sqrt(n), (name, power, r)


def test_no_value_comes_twice() -> None:
    grid = draws(uniform, np.arange(20)[:, None, None], np.arange(200)[:, None], np.arange(13))
    assert len(np.unique(grid)) == grid.size


@given(SEEDS, st.integers(0, 10**6), st.integers(0, 12))
def test_the_value_depends_on_its_place_alone(seed: int, second: int, channel: int) -> None:
    first = normal(seed, second, channel)
    normal(seed, second + 1, channel)
    assert normal(np.int64(seed), np.int64(second), np.int64(channel)) == first
