"""A small Bayesian optimiser: a Gaussian process with a Matérn kernel, and expected improvement."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import norm, qmc

Values = NDArray[np.float64]
LENGTHS: Final = (0.1, 0.2, 0.4, 0.8, 1.6)
"""Length scales of which the likeliest is taken, in ranges [1]."""
NOISES: Final = (1e-6, 1e-3)
"""Variances beside the process of which the likeliest is taken, in that of the values [1]."""
REFIT: Final = 10
"""Evaluations after which length scale and noise are chosen again."""
LOOKED_AT: Final = 1024
"""Points whose expected improvement is worked out for each evaluation; half of them lie around the best one."""
NEAR: Final = 0.05
"""How far around, in ranges [1]."""
FLOOR: Final = 1e-3
"""What is added before the logarithm of a value is taken: penalties are a thousand times what is to be told apart."""


def minimise(objective: Callable[[Values], Values], start: Values, budget: int, seed: int) -> float:
    """The least value that was found in the unit cube with ``budget`` evaluations, one after the other.

    The first ones, five a dimension and at most half, are ``start`` and a scrambled Sobol sequence.
    """
    rng, dimensions = np.random.default_rng(seed), len(start)
    first = max(min(5 * dimensions, budget // 2), 1)
    sobol = qmc.Sobol(dimensions, seed=seed).random(2 ** int(np.ceil(np.log2(first))))
    points = np.vstack([start, sobol])[:first]
    values = objective(points)
    length, noise = LENGTHS[2], NOISES[0]
    while len(values) < budget:
        told = np.log(np.maximum(values, 0.0) + FLOOR)
        scaled = (told - told.mean()) / (told.std() or 1.0)
        if (len(values) - first) % REFIT == 0:
            length, noise = max(
                ((one, other) for one in LENGTHS for other in NOISES), key=lambda p: _likelihood(points, scaled, *p)
            )
        near = points[np.argmin(values)] + NEAR * rng.standard_normal((LOOKED_AT // 2, dimensions))
        candidates = np.clip(np.vstack([rng.random((LOOKED_AT // 2, dimensions)), near]), 0.0, 1.0)
        best = candidates[np.argmax(_improvement(points, scaled, candidates, length, noise))][None]
        points, values = np.vstack([points, best]), np.append(values, objective(best))
    return float(values.min())


def _kernel(one: Values, other: Values, length: float) -> Values:
    apart = np.sqrt(5.0) * np.sqrt(((one[:, None] - other[None]) ** 2).sum(axis=2)) / length
    return np.asarray((1.0 + apart + apart**2 / 3.0) * np.exp(-apart))


def _likelihood(points: Values, values: Values, length: float, noise: float) -> float:
    factor, lower = cho_factor(_kernel(points, points, length) + (noise + 1e-9) * np.eye(len(points)), lower=True)
    return float(-0.5 * values @ cho_solve((factor, lower), values) - np.log(np.diag(factor)).sum())


def _improvement(points: Values, values: Values, candidates: Values, length: float, noise: float) -> Values:
    """Expected improvement on the least of ``values`` at each candidate."""
    factor = cho_factor(_kernel(points, points, length) + (noise + 1e-9) * np.eye(len(points)), lower=True)
    across = _kernel(candidates, points, length)
    mean = across @ cho_solve(factor, values)
    left = 1.0 - np.einsum("ij,ji->i", across, cho_solve(factor, across.T))
    sigma = np.sqrt(np.maximum(left, 1e-12))
    gain = values.min() - mean
    return np.asarray(gain * norm.cdf(gain / sigma) + sigma * norm.pdf(gain / sigma))
