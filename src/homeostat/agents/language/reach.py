"""Reach: whether a path's commands can cure what was violated, as far as sensitivities tell."""

import math
from collections.abc import Mapping, Sequence
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.advice import Sensitivity
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.domain.verdict import Finding

HALF: Final = 0.5
"""Straight lines must make up for this much of every violation: margins may turn out twice as steep farther away."""
SMALL: Final = 1.0
"""Violations up to this many scales are small [1]."""
CLOSE: Final = 1e-3
"""What the ascent may miss, in scales [1]."""
STEPS: Final = 600
"""Steps of the ascent."""
FIRST: Final = 0.5
"""Length of its first step, in ranges of the commands [1]."""
SHRINK: Final = 0.985
"""Length of a step in lengths of the one before [1]."""

Vec: TypeAlias = NDArray[np.float64]
Matrix: TypeAlias = NDArray[np.float64]


def curable(
    findings: Sequence[Finding],
    slopes: Sequence[Sensitivity],
    chosen: Mapping[str, float | None],
    choices: Sequence[SetpointRange],
    scales: Mapping[str, float],
) -> bool:
    """Whether other values inside the ranges of ``choices`` could cure what ``findings`` violate with ``chosen``.

    Margins are taken for straight lines of the commands. Where all violations are small, all must be cured together:
    what a command wins for one margin and loses for another counts. Where one is large, each must be curable by itself,
    because slopes may change their sign on the way. A margin that does not move near ``chosen`` says nothing about
    what is farther away and is left out; where none moves, nothing is known to help. A refusal without margin can be
    cured by another answer.
    """
    known = {(s.criterion, s.tag): s.slope for s in slopes}
    tags = [r.tag for r in choices if any(known.get((f.criterion, r.tag)) for f in findings)]
    moving = [f for f in findings if any(known.get((f.criterion, tag)) for tag in tags)]
    if not any(not f.satisfied for f in moving):
        return all(f.criterion.startswith("CHK-") for f in findings if not f.satisfied)
    low, high = _ways(tags, chosen, choices)
    units = [scales.get(f.unit, 1.0) for f in moving]
    steep = [[known.get((f.criterion, tag), 0.0) / unit for tag in tags] for f, unit in zip(moving, units, strict=True)]
    margins = np.array([f.relative(scales) * (1.0 if f.satisfied else HALF) for f in moving])
    width = high - low
    slopes_in_ranges = np.array(steep) * width
    small = margins.min() >= -HALF * SMALL
    groups = [slice(None)] if small else [slice(k, k + 1) for k in range(len(moving)) if not moving[k].satisfied]
    best = [best_together(margins[g], slopes_in_ranges[g], low / width, high / width) for g in groups]
    return min(best) >= -CLOSE


def best_together(margins: Vec, slopes: Matrix, low: Vec, high: Vec) -> float:
    """The largest least margin over a box: max over d in [low, high] of min over i of margins_i + slopes_i . d.

    Found by projected subgradient ascent (Shor, 1985) from d = 0 with steps that shrink geometrically.

    >>> round(best_together(np.array([-1.0, 0.5]), np.array([[2.0], [-1.0]]), np.array([-1.0]), np.array([1.0])), 3)
    0.0
    """
    point, length, best = np.zeros(len(low)), FIRST, -math.inf
    for _ in range(STEPS):
        values = margins + slopes @ point
        worst = int(np.argmin(values))
        best = max(best, float(values[worst]))
        steepness = float(np.linalg.norm(slopes[worst]))
        if steepness == 0.0:
            break
        point = np.clip(point + length / steepness * slopes[worst], low, high)
        length *= SHRINK
    return best


def _ways(tags: Sequence[str], chosen: Mapping[str, float | None], choices: Sequence[SetpointRange]) -> tuple[Vec, Vec]:
    """How far each command can be moved down (negative) and up, in its unit, shapes (tags,)."""
    ranges = {r.tag: r for r in choices}
    low, high = [], []
    for tag in tags:
        value, admitted = chosen[tag], ranges[tag]
        assert value is not None  # or it would have no slope
        low.append(min(admitted.low - value, 0.0))
        high.append(max(admitted.high - value, 0.0))
    return np.array(low), np.array(high)
