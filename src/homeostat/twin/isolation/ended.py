"""Ended: whether what was known to be wrong is over, told by the last readings alone.

A replay of minutes in which a fault was there cannot say that it has gone: nothing explains their beginning. So
stretches at the end of the readings are looked at by themselves. A fault is over where nothing explains such a stretch
clearly better than whatever was known does. One that cannot be seen, as fouling without feed, explains as much as
nothing does, and is not forgotten.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from homeostat.domain.diagnosis import FaultMode, Hypothesis, by_fault_set
from homeostat.process.batch import ProcessError
from homeostat.twin.carried import FaultSet, scaled
from homeostat.twin.history import Window
from homeostat.twin.isolation.beginnings import begins_in
from homeostat.twin.isolation.course import stopped
from homeostat.twin.isolation.ends import best_end
from homeostat.twin.isolation.evidence import Evidence, Fit
from homeostat.twin.isolation.responses import FIRST_ROW

STRETCHES = (10, 24, 40, 80, 160, 320)
"""Stretches that are looked at, in readings."""
SETTLE = 8
"""The first of so many parts of a stretch says what state it begins in, where the plant settles for so long."""
OVER_NATS = 8.0
"""By how much nothing must explain one better than anything that was known [nats]."""
THERE_NATS = 2.0
"""What was known is still there where it explains any stretch better than nothing by so much [nats]."""
SHORT = 10
"""Readings in a block that nothing must explain as well: a stretch that begins before the end of a fault is explained
on the whole, and badly at one of its ends."""
CHANGED = 80
"""Where nothing is better than what was known, but leaves more than noise, a stretch of so many readings says so."""
SIZES = (0.97, 1.0, 1.03)
"""Multiples of its size with which each of these is tried: nobody knew it exactly [1]."""
TURNS = tuple(k / 8.0 for k in range(8))
"""Shares of a turn by which what is known to swing may do so later [1]."""
SMALLER = tuple(0.05 * k for k in range(4, 20))
"""The same, of which none may explain a stretch clearly better than nothing: a size that was thought far too large is
refuted by a fault that is there as much as by one that has gone [1]."""
LEAST_LEFT = 0.5
"""Share of the likeliest size below which another one that was said is not asked whether it has ended [1]."""
LESS_NATS = 1.0
"""By how much one of these must for that [nats]: noise alone gives the best of them so much in one stretch of a
hundred."""


@dataclass(frozen=True, slots=True)
class Ended:
    """That what was known is over."""

    since_s: float
    """Process time from which it is, at the latest [s]."""
    fits: bool
    """Whether nothing is wrong since then; otherwise something else may be."""


def ended(
    known: Sequence[FaultSet],
    windows: Iterable[Window],
    compared: Callable[[Window], Evidence],
    modes: Mapping[str, FaultMode],
) -> Ended | None:
    """That all that was ``known`` is over, where it is; None where it is not, or nobody can tell.

    ``windows`` end now, the shortest first; ``compared``: one of them as evidence, ProcessError where the model leaves
    the physical world. It is over since the first of the readings that nothing explains throughout, or of the shortest
    stretch: what is looked at afterwards has hardly a part in which it was there.
    """
    every = list(windows)
    return _in_a_stretch(known, every, compared, modes) or _within(known, every, compared, modes)


def _in_a_stretch(
    known: Sequence[FaultSet],
    windows: Sequence[Window],
    compared: Callable[[Window], Evidence],
    modes: Mapping[str, FaultMode],
) -> Ended | None:
    """As :func:`ended`, by readings that nothing explains from the first of them on."""
    found, since_s, shortest_s, throughout = None, -np.inf, -np.inf, True
    turn_s = max((f.period_s for faults in known for f in faults), default=0.0)
    for window in windows:
        if window.length < min(turn_s / window.tick_s, STRETCHES[-1]):  # every turn passes nothing twice
            continue
        seen = stretch(window)
        shortest_s = max(shortest_s, window.start_s)
        if begins_in(seen, known):
            continue
        try:
            evidence = compared(seen)
            fit, well = fit_of_nothing(evidence)
        except ProcessError:  # without what was known the model leaves the physical world
            break
        throughout = throughout and well
        since_s = window.start_s if throughout else since_s
        lead = lead_of_nothing(evidence, known, _stopped(known, modes, seen))
        if lead >= OVER_NATS and not fit.strained:
            found = Ended(since_s if np.isfinite(since_s) else shortest_s, fits=True)
        elif lead >= OVER_NATS and fit.good and window.length >= CHANGED:
            half_s = window.at_s(window.length - 1 - window.length // 2)
            return found or Ended(since_s if half_s < since_s < shortest_s else half_s, fits=False)
        elif found or lead <= -THERE_NATS or (lead <= 0.0 and fit.strained):
            break
    return found


def _within(
    known: Sequence[FaultSet],
    windows: Sequence[Window],
    compared: Callable[[Window], Evidence],
    modes: Mapping[str, FaultMode],
) -> Ended | None:
    """As :func:`ended`, by readings in which it was there until it ended, and which that explains from first to last.

    Of what swings every turn looks like an end, and what has not been there for longer than stretches last may swing.
    """
    if any(f.period_s for faults in known for f in faults):
        return None
    for window in windows:
        if any(window.end_s - f.onset_s < STRETCHES[-1] * window.tick_s for faults in known for f in faults):
            return None
        if begins_in(window, known):
            continue
        throughout = [*known, *_stopped(known, modes, window)]
        try:
            evidence = compared(window)
            end = best_end(evidence, known, [*_sized(throughout), *_less_of(known)])
        except ProcessError:
            continue
        if end is not None and end.lead >= OVER_NATS and end.over_less >= -LESS_NATS and not end.fit.strained:
            return Ended(end.since_s, fits=True)
    return None


def _stopped(known: Sequence[FaultSet], modes: Mapping[str, FaultMode], window: Window) -> list[FaultSet]:
    """Each set of ``known`` where what grew in it does so no more: nobody knew how long it would."""
    ends = modes, window.at_s(FIRST_ROW), window.end_s
    return [replayed for faults in known for _, replayed in stopped(faults, faults, *ends)]


def stretch(window: Window) -> Window:
    """``window`` as it is looked at by itself.

    No more readings say where it begins than the plant states: the mean of a tank's level while it is emptied is none
    that it had.
    """
    return replace(window, settle_rows=min(window.settle_rows, max(window.length // SETTLE, 3)))


def left_open(said: Sequence[Hypothesis]) -> list[FaultSet]:
    """Every size that was ``said`` of each set of faults, the likeliest first, but what is far less than that.

    How little of a fault may be there still is :data:`SMALLER`'s to ask.
    """
    likeliest = {each.name: {f.fault: abs(f.severity) for f in each.faults} for each in by_fault_set(said)}

    def near(each: Hypothesis) -> bool:
        return all(abs(f.severity) >= LEAST_LEFT * likeliest[each.name][f.fault] for f in each.faults)

    return list(dict.fromkeys(each.faults for each in said if near(each)))


def fit_of_nothing(evidence: Evidence) -> tuple[Fit, bool]:
    """How well nothing explains the readings, and whether it does so from the first of them to the last.

    ProcessError where the model leaves the physical world.
    """
    left = evidence.left(evidence.residuals([()]))[0]
    return evidence.fit(left), not evidence.fit(left, SHORT).strained


def lead_of_nothing(evidence: Evidence, known: Sequence[FaultSet], stopped: Sequence[FaultSet] = ()) -> float:
    """By how much nothing explains the readings better than the best set of what was ``known`` [nats].

    ``stopped``: what that may have come to where it grew. Where less of it explains them clearly better than nothing,
    it is by how much nothing explains them better than that, which is negative.
    """
    whole, less = list(_sized([*known, *stopped])), list(_less_of(known))
    nats = evidence.likelihoods([(), *whole, *less])
    if not np.isfinite(nats[0]):
        return -np.inf
    lead, over_less = (float(nats[0] - part.max(initial=-np.inf)) for part in np.split(nats[1:], [len(whole)]))
    return min(lead, over_less) if over_less <= -LESS_NATS else lead


def _sized(known: Sequence[FaultSet]) -> Iterator[FaultSet]:
    """Each set of ``known``, smaller and larger, and at other moments of a turn: nobody knew a period exactly."""
    for faults in known:
        swings = any(fault.period_s for fault in faults)
        yield from (_later(scaled(faults, size), turn) for size in SIZES for turn in (TURNS if swings else (0.0,)))


def _later(faults: FaultSet, turn: float) -> FaultSet:
    """``faults``, of which what swings does so by a share of a ``turn`` later."""
    return tuple(replace(f, onset_s=f.onset_s + turn * f.period_s) for f in faults)


def _less_of(known: Sequence[FaultSet]) -> Iterator[FaultSet]:
    """Less of each set of ``known``: all of it smaller, and each of several by itself."""
    for faults in known:
        yield from (scaled(faults, size) for size in SMALLER)
        if len(faults) > 1:
            yield from (scaled((fault,), size) for fault in faults for size in (*SMALLER, 1.0))
