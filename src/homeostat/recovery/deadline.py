"""Deadline: how long agents may think before physics decides."""

import math

import numpy as np

from homeostat.domain.plant.limits import Limits
from homeostat.domain.verdict import Rollout, RolloutResult

SHORTEST_S = 1.0
"""Thinking gets this much process time even where physics leaves less: the fallback is armed meanwhile [s]."""


def deadline_s(
    idle: Rollout, limits: Limits, latency_s: float, reserve_s: float, left_s: float = math.inf, age_s: float = 0.0
) -> float:
    """Thinking time: ``latency_s``, or what is left before the first hard limit is violated without action [s].

    ``idle``: what happens without action, from a sample on that is ``age_s`` old [s]; ``reserve_s``: what is kept for
    the fallback to act [s]; ``left_s``: until a time to act by that stands already [s].
    """
    return min(latency_s, max(min(first_violated_s(idle, limits) - age_s - reserve_s, left_s), SHORTEST_S))


def act_by_s(idle: Rollout, limits: Limits, now_s: float, reserve_s: float, age_s: float = 0.0) -> float | None:
    """Process time by which something must be done, ``reserve_s`` before a hard limit is violated without it [s].

    ``idle`` begins with a sample that is ``age_s`` old [s]: what was not read has passed all the same. None where no
    limit is violated. The shortest thinking and ``reserve_s`` for the guard to write are left in any case: a limit that
    is violated meanwhile trips by itself. So this moves later with ``now_s``; an earlier time that stands in the guard
    counts all the same.
    """
    first_s = first_violated_s(idle, limits)
    return None if math.isinf(first_s) else now_s + max(first_s - age_s - reserve_s, SHORTEST_S + reserve_s)


def first_violated_s(idle: Rollout, limits: Limits) -> float:
    """Process time until a hard limit trips in any member; at once where the twin cannot say [s]."""
    if idle.result is not RolloutResult.COMPLETED:
        return 0.0
    return min((violated_s for violated_s, _ in _violated(idle, limits)), default=math.inf)


def endangered(idle: Rollout, limits: Limits) -> tuple[str, ...]:
    """Names of the hard limits that trip without action in any member, the first one first; none where nobody knows."""
    if idle.result is not RolloutResult.COMPLETED:
        return ()
    return tuple(name for _, name in sorted(_violated(idle, limits), key=lambda found: found[0]))


def _violated(idle: Rollout, limits: Limits) -> list[tuple[float, str]]:
    """Process time until it trips [s] and name, of every hard limit that does."""
    found = []
    for limit in limits.hard:
        margins = limit.watched.margins(idle.trajectory.signals, idle.trajectory.dt_s)
        violated = np.flatnonzero(~(margins >= 0.0).all(axis=0))  # undecided is not kept
        if violated.size:
            found.append((float(violated[0]) * idle.trajectory.dt_s, limit.name))
    return found
