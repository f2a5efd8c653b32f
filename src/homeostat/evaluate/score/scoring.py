"""Scoring: what the plant truly did, as numbers; what they come to is in :mod:`homeostat.evaluate.score.outcome`."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.production import Production
from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.process.types import Vec
from homeostat.record.result import Exposure

CALM_S = 60.0
"""A plant that ends inside its hard limits keeps them over the last this many seconds, by the reference [s]."""
RETURN_S = 60.0
"""What is outside a limit at detection may swing about it this much longer than until it first comes back, by the
reference [s]."""
FED_S = 60.0
"""What a plant is fed at the end is the mean over the last this many seconds, by the reference [s]."""
LEAST_FED = 0.1
"""A plant that produces is fed at least this share of its design rate at the end [1]."""
LEAST_DELIVERED = 0.25
"""A plant that produces delivers at the end at least this share of what it delivers without a fault [1]. Recoveries
that run at part load deliver about half; a limit that is lifted for what passes while a plant stands still, as
``Q <= 4 or F <= 0.001`` at a design of 0.004, lets up to a quarter pass. What keeps its limits by that is held."""
DELIVERED_S = 300.0
"""What a plant delivers at the end is the mean over the last this many seconds, by the reference [s]: a vessel comes
between feed and product, and a loop that brings its level to another setpoint keeps some back for about a response."""
LEAST_PRODUCT = 0.9
"""A batch that is complete has at least this share of the fault-free product [1]."""
SAME_LOSS = 0.005
"""Losses of production, and costs as shares of what is made by design, that differ by no more than this are the same:
disturbances alone make as much [1]."""
_EQUAL = 1e-9
"""What rounding may make of a share [1]."""


def exposures(truth: Trajectory, force: LimitsInForce, detected_s: float | None) -> tuple[Exposure, ...]:
    """Exposure to every trip limit and envelope, where it is in ``force``."""
    late = truth.times_s > (np.inf if detected_s is None else detected_s)
    result = []
    for limit in force.limits.limits:
        if limit.kind is LimitKind.PERMISSIVE:
            continue
        outside = force.outside(limit, truth)  # where it cannot be judged, too
        seconds = (float((outside & late).sum()) * truth.dt_s, float(outside.sum()) * truth.dt_s)
        result.append(Exposure(limit.name, *seconds))
    return tuple(result)


def inside_at_end(truth: Trajectory, force: LimitsInForce, timing: Timing = REFERENCE) -> bool:
    """Whether the plant, of this ``timing``, kept its hard limits over the time :data:`CALM_S` at the end."""
    judged = truth.times_s > float(truth.times_s[-1]) - timing.time_s(CALM_S)
    return not any(force.outside(limit, truth)[judged].any() for limit in force.limits.hard)


def missed_at_end(truth: Trajectory, force: LimitsInForce, timing: Timing = REFERENCE) -> tuple[str, ...]:
    """Soft criteria and envelopes that the plant, of this ``timing``, missed within the time :data:`CALM_S` at the end.

    What cannot be judged there was not missed.
    """
    judged = truth.times_s > float(truth.times_s[-1]) - timing.time_s(CALM_S)
    return tuple(each.name for each in force.limits.priced if (force.margins(each, truth)[judged] < 0.0).any())


def production_loss(
    truth: Trajectory, healthy: Trajectory, delivered: Sequence[str], from_s: float, to_s: float | None = None
) -> float:
    """Fraction of the fault-free production between two times that was lost [1].

    ``delivered`` names the true quantities whose sum is what was produced so far (delivered, or still in the plant).
    NaN where nothing would have been produced in that time, or where it is not known what was.
    """
    possible = made(healthy, delivered, from_s, to_s)
    return 1.0 - made(truth, delivered, from_s, to_s) / possible if possible else math.nan


def made(run: Trajectory, delivered: Sequence[str], from_s: float, to_s: float | None = None) -> float:
    """What was produced between two times, in the unit of the ``delivered`` quantities; NaN where none is named."""
    first = int(np.searchsorted(run.times_s, from_s))
    last = run.length - 1 if to_s is None else int(np.searchsorted(run.times_s, to_s))
    return float(sum(run.signals[d][0, last] - run.signals[d][0, first] for d in delivered)) if delivered else math.nan


def fed_at_end(truth: Trajectory, production: Production, timing: Timing = REFERENCE) -> bool:
    """Whether the plant is fed at the end: over :data:`FED_S`, at least :data:`LEAST_FED` of its design rate."""
    last = truth.times_s > truth.times_s[-1] - timing.time_s(FED_S)
    fed = float(truth.signals[production.throughput][0, last].mean())
    return fed >= (LEAST_FED - _EQUAL) * production.design_rate


def delivers_at_end(
    truth: Trajectory,
    healthy: Trajectory,
    leaving: Sequence[str],
    from_s: float,
    timing: Timing = REFERENCE,
) -> bool:
    """Whether the plant delivers at the end: over :data:`DELIVERED_S`, at least :data:`LEAST_DELIVERED` of ``healthy``.

    ``leaving`` names what leaves it, added up. Never longer than since ``from_s`` [s]. Where nothing leaves the
    fault-free run, nothing is asked for; what is not known is not delivered.
    """
    since_s = max(float(truth.times_s[-1]) - timing.time_s(DELIVERED_S), from_s)
    possible = made(healthy, leaving, since_s)
    return made(truth, leaving, since_s) >= (LEAST_DELIVERED - _EQUAL) * possible


def has_product(truth: Trajectory, healthy: Trajectory, delivered: Sequence[str]) -> bool:
    """Whether a run has its product: at least :data:`LEAST_PRODUCT` of what the fault-free run delivers."""
    possible = made(healthy, delivered, truth.start_s)
    return made(truth, delivered, truth.start_s) >= (LEAST_PRODUCT - _EQUAL) * possible  # not where one is NaN


def outside_after(truth: Trajectory, force: LimitsInForce, from_s: float = -math.inf) -> dict[str, Vec]:
    """Hard limit -> times after ``from_s`` at which its true value is outside [s], empty ones left out."""
    judged = truth.times_s > from_s
    found = {limit.name: truth.times_s[judged & force.outside(limit, truth)] for limit in force.limits.hard}
    return {name: times for name, times in found.items() if times.size}


def kept_until(
    outside: Mapping[str, Vec], truth: Trajectory, from_s: float, timing: Timing = REFERENCE
) -> dict[str, float] | None:
    """Hard limit that is outside at ``from_s`` already -> until when it may be [s]; None where a limit is not kept.

    ``outside`` is what :func:`outside_after` found in ``truth``. What is outside at once is kept if it comes back, and
    is outside no more from :data:`RETURN_S` after that.
    """
    found, return_s = dict[str, float](), timing.time_s(RETURN_S)
    for name, times in outside.items():
        if times[0] > from_s + truth.dt_s:
            return None
        gaps = np.flatnonzero(np.diff(times) > 1.5 * truth.dt_s)
        back_s = float(times[gaps[0]] if gaps.size else times[-1]) + truth.dt_s
        if back_s > truth.times_s[-1] or times[-1] > back_s + return_s:
            return None
        found[name] = back_s + return_s
    return found


def worse(outside: Mapping[str, Vec], until: Mapping[str, float]) -> bool:
    """Whether a run with these times ``outside`` violates what another kept ``until``."""
    return any(times[-1] > until.get(name, -math.inf) for name, times in outside.items())
