"""Deadline: how long agents may think before physics decides."""

from __future__ import annotations

import math

import numpy as np

from homeostat.domain.limits import Limits
from homeostat.domain.verdict import Rollout, RolloutResult

SHORTEST_S = 1.0
"""Thinking gets this much process time even where physics leaves less: the fallback is armed meanwhile [s]."""


def deadline_s(idle: Rollout, limits: Limits, latency_s: float, reserve_s: float) -> float:
    """Thinking time: ``latency_s``, or what is left before the first hard limit breaks without action [s].

    ``idle``: what happens without action; ``reserve_s``: what is kept for the fallback to act [s].
    """
    return min(latency_s, max(first_broken_s(idle, limits) - reserve_s, SHORTEST_S))


def first_broken_s(idle: Rollout, limits: Limits) -> float:
    """Process time until a hard limit breaks in any member; at once where the twin cannot say [s]."""
    if idle.result is not RolloutResult.COMPLETED:
        return 0.0
    first = math.inf
    for limit in limits.hard:
        margins = limit.formula.margins(idle.trajectory.signals, idle.trajectory.dt_s)
        broken = np.flatnonzero(~(margins >= 0.0).all(axis=0))  # undecided is not kept
        if broken.size:
            first = min(first, float(broken[0]) * idle.trajectory.dt_s)
    return first
