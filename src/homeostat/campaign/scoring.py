"""Scoring: what the plant truly did; the only place that may say 'recovered'."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from homeostat.domain.limits import LimitKind, Limits
from homeostat.domain.snapshot import Trajectory

CALM_S = 300.0
"""A recovered plant keeps its hard limits over the last this many seconds [s]."""


class OutcomeKind(StrEnum):
    """How a run ended."""

    RECOVERED = "recovered"
    """Actions were released, no fallback acted, and the plant ended inside its hard limits."""
    HANDED_OVER = "handed_over"
    """The fallback acted, or the plant ended outside its hard limits."""
    NO_ACTION = "no_action"
    """Nothing was released, and the plant ended inside its hard limits."""
    NOT_DETECTED = "not_detected"
    """A fault was injected and never reported."""


@dataclass(frozen=True, slots=True)
class Exposure:
    """How long the true value was outside one limit."""

    limit: str
    """Name of the limit."""
    from_detection_s: float
    """Seconds outside from detection on [s]."""
    total_s: float
    """Seconds outside since the plant left start-up [s]."""


def exposures(truth: Trajectory, limits: Limits, started_s: float, detected_s: float | None) -> tuple[Exposure, ...]:
    """Exposure to every interlock and envelope."""
    times = truth.times_s
    running = times > started_s
    late = times > (np.inf if detected_s is None else detected_s)
    result = []
    for limit in limits.limits:
        if limit.kind is LimitKind.PERMISSIVE:
            continue
        margins = np.broadcast_to(limit.formula.margins(truth.signals, truth.dt_s), (1, times.size))
        outside = ~(margins[0] >= 0.0) & running  # where it cannot be judged, too
        seconds = (float((outside & late).sum()) * truth.dt_s, float(outside.sum()) * truth.dt_s)
        result.append(Exposure(limit.name, *seconds))
    return tuple(result)


def inside_at_end(truth: Trajectory, limits: Limits, started_s: float = 0.0) -> bool:
    """Whether the plant kept its hard limits over the last :data:`CALM_S` seconds, start-up left out."""
    judged = truth.times_s > max(started_s, float(truth.times_s[-1]) - CALM_S)
    margins = (limit.formula.margins(truth.signals, truth.dt_s) for limit in limits.hard)
    return all((np.broadcast_to(m, (1, judged.size))[:, judged] >= 0.0).all() for m in margins)


def production_loss(
    truth: Trajectory, healthy: Trajectory, delivered: Sequence[str], from_s: float, to_s: float | None = None
) -> float:
    """Fraction of the fault-free production between two times that was lost [1].

    ``delivered`` names the true quantities whose sum is what was produced so far (delivered, or still in the plant).
    NaN where nothing would have been produced in that time.
    """
    first = int(np.searchsorted(truth.times_s, from_s))
    last = truth.length - 1 if to_s is None else int(np.searchsorted(truth.times_s, to_s))

    def made(run: Trajectory) -> float:
        return float(sum(run.signals[d][0, last] - run.signals[d][0, first] for d in delivered))

    possible = made(healthy)
    return 1.0 - made(truth) / possible if possible else math.nan


def outcome(faulty: bool, detected: bool, released: int, fallbacks: int, inside: bool) -> OutcomeKind:
    """The outcome of a run from what happened in it."""
    if fallbacks:
        return OutcomeKind.HANDED_OVER
    if faulty and not detected:
        return OutcomeKind.NOT_DETECTED
    if not inside:
        return OutcomeKind.HANDED_OVER
    return OutcomeKind.RECOVERED if released else OutcomeKind.NO_ACTION
