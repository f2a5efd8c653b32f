"""Claims: what is said to have begun before the readings that are looked at must explain the readings of then, too.

A fault that was known for an hour began where no replay reaches any more, and another one may take its place since the
same moment, unless somebody asks what was read then. A thermometer that is said to read 7 K high since an hour ago
read as it should a minute after, and a fouled jacket was what explained that.

    cost of an explanation = max(0, ln p(readings of then | what was known) - ln p(readings of then | explanation))

each at the best of :data:`SIZES`, because sizes were other ones then: an explanation is charged alike at every size.
Nothing is charged of what was said before.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from homeostat.process.batch import ProcessError
from homeostat.twin.carried import FaultSet
from homeostat.twin.history import Window
from homeostat.twin.isolation.course import continues
from homeostat.twin.isolation.evidence import Evidence

SIZES = (0.2, 0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.5)
"""Multiples of the size that is said now with which readings of then are explained [1]."""
MOST_NATS = 30.0
"""What is charged at most: a model errs, and more is not needed [nats]."""
FEWEST = 30
"""Readings after a beginning that say something of it."""

Past: TypeAlias = Callable[[float], Window | None]
"""Process time of a beginning [s] -> the readings around it; None where they are held no more."""


def forgotten(onset_s: float) -> None:
    """A past of which nothing is held."""
    return


class Claims:
    """Charges explanations for what they say of a time that is not looked at."""

    def __init__(self, known: FaultSet, said: Sequence[FaultSet], evidence: Evidence, first_s: float, past: Past):
        """``known`` is what was likeliest, ``said`` all that was said before, of what began before ``first_s`` [s]."""
        self._known, self._said, self._evidence, self._first_s = known, said, evidence, first_s
        self._past, self._then = past, dict[float, tuple[Evidence, float] | None]()
        self._costs = dict[tuple[tuple[str, float], ...], float]()

    def of(self, faults: FaultSet) -> float:
        """What an explanation is charged [nats]; 0 where it says nothing new of the time before."""
        modes = self._evidence.carrier.modes
        old = tuple(f for f in faults if f.onset_s < self._first_s)
        new = [f for f in old if not any(continues(f, k, modes) for each in self._said for k in each)]
        if not self._known or not new:
            return 0.0
        names = tuple((f.fault, f.onset_s) for f in old)
        if names not in self._costs:
            self._costs[names] = self._cost(old, min(f.onset_s for f in new))
        return self._costs[names]

    def _cost(self, faults: FaultSet, began_s: float) -> float:
        if began_s not in self._then:
            self._then[began_s] = self._look(began_s)
        then = self._then[began_s]
        return 0.0 if then is None else float(np.clip(then[1] - _likelihood(then[0], faults), 0.0, MOST_NATS))

    def _look(self, began_s: float) -> tuple[Evidence, float] | None:
        """The readings around a beginning, and how likely they are with what was known; None where nobody can say."""
        window = self._past(began_s)
        if window is None or window.length - 1 - window.row(began_s) < FEWEST:
            return None
        try:
            evidence = self._evidence.on(window)
        except ProcessError:  # the readings at the beginning are no state of the model
            return None
        best = _likelihood(evidence, self._known)
        return (evidence, best) if np.isfinite(best) else None


def _likelihood(evidence: Evidence, faults: FaultSet) -> float:
    """Log-likelihood of ``faults`` at their best size [nats]; minus infinity where the model breaks down with them."""
    sets = [tuple(replace(f, severity=size * f.severity) for f in faults) for size in SIZES]
    try:
        return float(np.max(evidence.likelihoods(sets)))
    except ProcessError:
        return -np.inf
