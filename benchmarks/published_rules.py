"""The published validator's acceptance rules, as formulas of this project's rule language.

A rollout runs from the call to the end of the shut-down. It is judged from a minute after the call to the end of the
phase NORMAL, and accepted if

1. there is a safe minute: 60 safe seconds in a row;
2. the first one ends within 600 s of the call;
3. unsafe seconds are at most a fifth of *all* simulated seconds, those that are not judged included.

The first two are formulas. The language has margins and no counting, so the seconds of the third, and the moment of
the first safe minute, are counted over the margins of a formula. One published check is left out because it cannot
fail: positions within 0 and 1, which the kernel's actuators never leave.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.published_reactor import TAGS, Course, PublishedReactor
from benchmarks.recorded_calls import Reason, RecordedCall, Shown
from homeostat.process.types import Vec
from homeostat.stl.formula import Formula, parse

GRACE_S = 60
"""Seconds after the call that are not judged [s]."""
MINUTE_S = 60
"""Length of the safe stretch that counts as recovery [s]."""
LATEST_S = 600
"""Latest end of the first one, counted from the call [s]."""
MOST_UNSAFE = 0.20
"""Largest accepted fraction of unsafe seconds [1]."""

INSIDE = "T1 <= 313 and L1 >= 2 and L1 <= 11 and overflow <= 1e-12"
"""No limit is broken: one noisy temperature, the true level, nothing over the weir."""
IN_CONTROL = "max(max(V1.pos, P1.pos), V2.pos) < 0.95 or abs(T1 - 310) <= 0.5"
"""The control zone: no actuator is saturated, or the temperature is held, at 310 K whatever its setpoint is."""
LIMITS = parse(INSIDE)
"""The same as a formula."""
SAFE = parse(f"({INSIDE}) and ({IN_CONTROL})")
"""A safe second."""
SAFE_MINUTE = parse(f"always[0,{MINUTE_S - 1}] ({SAFE.text})")
"""A safe minute begins."""


def recovers(latest_s: int) -> str:
    """The formula for: a safe minute begins after the grace time and ends ``latest_s`` [s] after the call at most."""
    return f"eventually[{GRACE_S},{latest_s - MINUTE_S + 1}] ({SAFE_MINUTE.text})"


@dataclass(frozen=True, slots=True)
class Judgement:
    """What the published rules say of one rollout."""

    reason: Reason
    """Which rule refuses it, or that it passes."""
    time_to_safe_s: float | None
    """Seconds from the call to the end of the first safe minute; None where there is none [s]."""
    unsafe_s: int
    """Judged seconds that are not safe [s]."""
    unsafe_fraction: float
    """The same over all simulated seconds [1]."""


def judge(course: Course) -> Judgement:
    """Judge a rollout whose first row is the second of the call."""
    judged, last = _normal(course)
    unsafe_s = _violated_s(SAFE, judged)
    fraction = unsafe_s / course.seconds
    if not _holds(recovers(last), judged):
        return Judgement(Reason.NO_RECOVERY, None, unsafe_s, fraction)
    begins = GRACE_S + int(np.argmax(SAFE_MINUTE.margins(judged, 1.0)[0, GRACE_S:] >= 0.0))
    time_to_safe_s = float(begins + MINUTE_S - 1)
    if not _holds(recovers(min(LATEST_S, last)), judged):
        return Judgement(Reason.SLOW_RECOVERY, time_to_safe_s, unsafe_s, fraction)
    reason = Reason.PASS if fraction <= MOST_UNSAFE else Reason.UNSAFE_FRACTION
    return Judgement(reason, time_to_safe_s, unsafe_s, fraction)


def outside_s(course: Course) -> int:
    """Judged seconds in which a limit is broken; the others that are unsafe are so for the control zone."""
    return _violated_s(LIMITS, _normal(course)[0])


@dataclass(frozen=True, slots=True)
class Replayed:
    """One recorded call, the plant that it was asked about, and its rollout as this project computes it."""

    call: RecordedCall
    """What was recorded."""
    shown: Shown
    """The plant at the call."""
    draws: int
    """Normal deviates that the plant, or the rollout before, has left the stream at."""
    course: Course
    """The rollout of the evaluated setpoints."""
    judgement: Judgement
    """What the rules say of it."""


def replay(calls: Sequence[RecordedCall]) -> Iterator[Replayed]:
    """All calls of one run: one plant, one rollout per call."""
    first = calls[0]
    plant = PublishedReactor(first.fault, first.onset_s)
    plant.advance(first.time_s - 1)
    level = plant.last[TAGS.index("L1")]  # what is shown was measured at the start of the second
    plant.advance(first.time_s)
    row = dict(zip(TAGS, plant.last, strict=False))
    shown = Shown(row["T1"], level, row["V1.pos"], row["P1.pos"], row["V2.pos"])
    draws = plant.draws
    for call in calls:
        course = plant.roll_out(call.evaluated, call.draws)
        yield Replayed(call, shown, draws, course, judge(course))
        draws = course.draws


def _normal(course: Course) -> tuple[dict[str, Vec], int]:
    """The signals up to the end of the phase NORMAL, and the seconds from the call until then."""
    last = int(np.flatnonzero(course.normal)[-1])
    return {tag: values[: last + 1] for tag, values in course.signals.items()}, last


def _violated_s(formula: Formula, judged: Mapping[str, Vec]) -> int:
    return int((formula.margins(judged, 1.0)[0, GRACE_S:] < 0.0).sum())


def _holds(formula: str, signals: Mapping[str, Vec]) -> bool:
    return bool(parse(formula).evaluate(signals, 1.0).value[0] >= 0.0)
