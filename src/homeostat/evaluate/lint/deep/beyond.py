"""Faults that take a plant out of the physical world later than its runs end, while nobody acts.

A vessel that loses a little for hours, or fills, comes to its end after every rollout of the other checks. From where
a fault begins the plant goes on for a run more, and as long as what still moves then needs to come to its end.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from homeostat.domain.diagnosis import FaultMode
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.following import recorded
from homeostat.evaluate.lint.deep.onward import Begun, onward, states_of
from homeostat.evaluate.lint.finding import Finding, Severity, amount
from homeostat.process.types import Table

MOST: Final = 20.0
"""Longest that is looked ahead, in runs of the plant [1]."""
WORK: Final = 2e7
"""States of members that are simulated for a tick in one go at most, of all that is asked: some seconds [1]."""
LATE: Final = 0.1
"""Share of a course at its end by which it is judged what still moves [1]."""
MORE: Final = 2.2
"""Multiple of the time to the end of what moves for which it is followed: by its own head twice that [1]."""


class _Asked(NamedTuple):
    """A fault of one size."""

    fault: FaultMode
    severity: float
    begun: Begun


def beyond(bench: Bench) -> Iterator[Finding]:
    """Every fault under which the model breaks although no hard limit was violated before; each once.

    A batch is none of it: what it does then is not what it does at the onset.
    """
    course = bench.quiet
    if course.broke or len(course.states) > 2 or not math.isfinite(course.settled_s):
        return
    bench.told("faults, for longer than a run")
    every, said = _asked(bench), set[str]()
    if not every:
        return
    for asked, from_s in _breaking(bench, every):
        if asked.fault.name in said or from_s <= bench.plant.end_s - bench.onset_s:  # a run shows it
            continue
        (truth,) = onward(bench, [asked.begun], from_s)
        if _guarded(bench, truth):
            continue
        said.add(asked.fault.name)
        yield _finding(bench, asked, truth)


def _asked(bench: Bench) -> list[_Asked]:
    """Each fault that has an equation, at its nominal severity and at its highest, from where it begins on."""
    d, (window, states) = bench.plant.description, recorded(bench)
    row = min(max(round(bench.onset_s / d.timing.tick_s), 1), len(states)) - 1
    begun = Begun(states[row], window.inputs[row], (row + 1) * d.timing.tick_s)
    return [
        _Asked(fault, severity, replace(begun, fault=fault.name, severity=severity, onset_s=begun.at_s))
        for fault in d.faults
        if fault.name in bench.plant.model.faults
        for severity in (fault.severity_nominal, fault.severity_range.high)
    ]


def _breaking(bench: Bench, every: Sequence[_Asked]) -> Iterator[tuple[_Asked, float]]:
    """What breaks, and how long after its onset at the latest [s]."""
    tick_s = bench.plant.description.timing.tick_s
    most, first_s = int(WORK / len(bench.plant.model.states)), bench.plant.end_s
    if len(every) * first_s / tick_s > most:  # a large model: nominal sizes, and for less than a run
        every = [each for each in every if each.severity == each.fault.severity_nominal]
        first_s = min(first_s, most / len(every) * tick_s)
    record, dt_s = states_of(bench, [each.begun for each in every], first_s)
    moving = []
    for each, states in zip(every, record, strict=True):
        if not np.isfinite(states).all():
            yield each, _broke_s(states, dt_s)
        elif end_s := _ends_s(bench, states, dt_s):
            moving.append((first_s + MORE * end_s, each))
    moving.sort(key=lambda pair: pair[0])
    while moving and len(moving) * moving[-1][0] / tick_s > most:
        moving.pop()
    if moving:
        bench.told("faults, until what moves has come to its end")
        record, dt_s = states_of(bench, [each.begun for _, each in moving], moving[-1][0])
        for (_, each), states in zip(moving, record, strict=True):
            if not np.isfinite(states).all():
                yield each, _broke_s(states, dt_s)


def _broke_s(states: Table, dt_s: float) -> float:
    """When they were first seen to be no numbers [s]."""
    return float(np.argmax(~np.isfinite(states).all(axis=1)) + 1) * dt_s


def _ends_s(bench: Bench, states: Table, dt_s: float) -> float:
    """Time after ``states`` until what moves, at its rate, is empty or beyond its instrument, the last of it [s]."""
    late = max(int(LATE * len(states)), 2)
    now, rate = states[-1], (states[-1] - states[-late]) / ((late - 1) * dt_s)
    before = (states[-late] - states[-2 * late + 1]) / ((late - 1) * dt_s) if len(states) >= 2 * late else rate
    steady = (np.abs(rate) > 0.0) & (rate * before > 0.0) & (np.abs(rate) >= 0.5 * np.abs(before))
    top, d = np.full(now.size, np.inf), bench.plant.description
    for signal in d.signals:
        column = bench.plant.model.shown.get(signal.variable)
        if column is not None:
            top[column] = signal.tag.range.high
    left = np.where(rate < 0.0, now, top - now)
    times = [float(left[i] / abs(rate[i])) for i in np.flatnonzero(steady & (left > 0.0))]
    return max((each for each in times if each <= MOST * bench.plant.end_s), default=0.0)


def _guarded(bench: Bench, truth: Trajectory) -> bool:
    """Whether a hard limit is violated before it breaks: a fallback acts."""
    there = np.isfinite(_states_known(truth))
    known = {tag: values[:, there] for tag, values in truth.signals.items()}
    if not there.any():
        return False
    return any((limit.formula.margins(known, truth.dt_s) < 0.0).any() for limit in bench.plant.description.limits.hard)


def _states_known(truth: Trajectory) -> np.ndarray:
    """A number where the plant is there, and NaN from when it broke, shape (times,)."""
    moving = [values[0] for values in truth.signals.values() if np.isfinite(values[0, 0])]
    return np.asarray(np.sum(moving, axis=0))


def _finding(bench: Bench, asked: _Asked, truth: Trajectory) -> Finding:
    known = np.isfinite(_states_known(truth))
    after_s, d = float(known.sum() + 1) * truth.dt_s, bench.plant.description
    size = amount(asked.severity, asked.fault.severity_unit, 6)
    place = bench.places.row("faults", id=asked.fault.name)
    horizon_s = float(bench.plant.twin.horizon_s)
    when = f"{after_s:.4g} s after its onset"
    late = f", later than a rollout of {horizon_s:g} s sees" if after_s > horizon_s else ""
    last = int(known.sum()) - 1
    near = [s.tag for s in d.signals if last > 0 and _far(truth, s.tag.name, last)]
    told = ", ".join(f"{tag.name!r} = {amount(float(truth.signals[tag.name][0, last]), tag.unit)}" for tag in near[:3])
    what = (
        f"{asked.fault.name!r} ({size}) takes the model out of the physical world {when}{late}"
        f"{f', last with {told}' if told else ''}, and no hard limit is violated before: nobody acts until then"
    )
    remedy = (
        "let the equations hold there (Vessel with draw, an overflow at the brim, something that a division does not "
        "come below), or state a hard limit with a fallback that acts before (limits.csv)"
    )
    return Finding(Severity.ERROR, "faults", place, what, remedy)


def _far(truth: Trajectory, tag: str, last: int) -> bool:
    """Whether a reading has come to almost nothing of what it was, or to many times that."""
    began, now = float(truth.signals[tag][0, 0]), float(truth.signals[tag][0, last])
    return math.isfinite(now) and began != 0.0 and not 0.05 <= now / began <= 5.0
