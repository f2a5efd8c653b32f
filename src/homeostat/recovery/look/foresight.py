"""Foresight: a rollout as people read it, in bands of what is limited and in times until limits are violated."""

import numpy as np

from homeostat.domain.events.foresight import Foreseen, ForeseenBand, Reached
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.verdict import Rollout, RolloutResult
from homeostat.process.types import Flags, Indices, Table, Vec

INTERVALS = 40
"""Most intervals of a band: what a picture of it needs."""
_DIGITS = 5
"""Significant digits of a band."""


def foreseen(rollout: Rollout, limits: Limits, digest: str = "") -> Foreseen:
    """What ``rollout`` of the actions with that ``digest`` says; it is empty where nothing is done.

    Hard limits count where they trip, as the guard and the time to think count them.
    """
    if rollout.result is not RolloutResult.COMPLETED or not rollout.weights:
        return Foreseen(digest, rollout.trajectory.start_s, 0.0, 0, note=rollout.note or rollout.result.value)
    course, weights = rollout.trajectory, np.asarray(rollout.weights)
    length_s = (course.length - 1) * course.dt_s
    judged = [
        x for x in limits.limits if x.kind is not LimitKind.PERMISSIVE and x.formula.tags <= course.signals.keys()
    ]
    violated = {x.name: ~(np.atleast_2d(x.watched.margins(course.signals, course.dt_s)) >= 0.0) for x in judged}
    reached = [r for name, flags in violated.items() if (r := _reached(name, flags, weights, course.dt_s)) is not None]
    hard = [violated[x.name] for x in judged if x.hard]
    first = _reached("", np.logical_or.reduce(hard), weights, course.dt_s) if hard else None
    edges = np.unique(np.linspace(0, course.length, min(INTERVALS, course.length) + 1).astype(int))
    tags = sorted({tag for x in judged for tag in x.formula.tags})
    bands = [b for tag in tags if (b := _band(tag, np.asarray(course.signals[tag]), edges)) is not None]
    ends = tuple(float(edge - 1) * course.dt_s for edge in edges[1:])
    timed = tuple(sorted(reached, key=lambda r: r.earliest_s))
    return Foreseen(digest, course.start_s, length_s, len(weights), ends, tuple(bands), first, timed)


def _reached(limit: str, violated: Flags, weights: Vec, dt_s: float) -> Reached | None:
    """When members first violate it, ``violated`` has shape (members, times); None where none does.

    What is undecided counts as violated.
    """
    some = violated.any(axis=1)
    if not some.any():
        return None
    times, worth = violated[some].argmax(axis=1) * dt_s, weights[some]
    order = np.argsort(times)
    middle = order[np.searchsorted(np.cumsum(worth[order]), 0.5 * worth.sum())] if worth.sum() > 0.0 else order[0]
    spread = float(times.min()), float(times[middle]), float(times.max())
    return Reached(limit, int(some.sum()), float(min(1.0, worth.sum() / weights.sum())), *spread)


def _band(tag: str, values: Table, edges: Indices) -> ForeseenBand | None:
    """The band of a tag whose ``values`` have shape (members, times); None where one is not known."""
    if not np.isfinite(values).all():
        return None
    low = np.minimum.reduceat(values.min(axis=0), edges[:-1])
    high = np.maximum.reduceat(values.max(axis=0), edges[:-1])
    return ForeseenBand(tag, tuple(map(_short, low)), tuple(map(_short, high)))


def _short(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
