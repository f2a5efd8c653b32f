"""Disturbances with the courses that chance gives them: of a run's seed, whatever was asked before and how often.

    wandering   0 at its begin; after each random time another random share of the size, on the cubic without a slope at
                either end: v + (v' - v) (3 u^2 - 2 u^3), u from 0 to 1, so that no share lies outside those at its ends
    bursting    u^2 for a random time, then 1 - 3 u^2 + 2 u^3 for the time that it takes back, and again

Times are equally likely between the two stated, shares from -1 to 1. Check: half-way from 0 to 0.8 it is at 0.4, and a
quarter of the way at 0.8 * (3/16 - 2/64) = 0.125.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from homeostat.domain.disturbance import Course, Disturbance, Shape
from homeostat.process.seeds import generator


@dataclass(frozen=True, slots=True)
class Acting:
    """A disturbance of one run."""

    what: Disturbance
    course: Course | None
    """What chance gives it; None where its text says it all."""

    @property
    def name(self) -> str:
        """Parameter, tag or actuator."""
        return self.what.name

    def share(self, at_s: float) -> float:
        """How much of its size it has at ``at_s`` [s], -1 to 1 [1]."""
        return self.what.share(at_s, self.course)

    def applied(self, value: float, at_s: float) -> float:
        """What ``value`` becomes of it at ``at_s`` [s]."""
        return self.what.changed(value, self.share(at_s))


def acting(disturbances: Sequence[Disturbance], seed: int) -> list[Acting]:
    """``disturbances`` with their courses, each drawn from the child of ``seed`` that its name and rank stand for.

    So another disturbance of something else changes no course. ``seed``: 0 or more.
    """
    found, seen = [], Counter[str]()
    for each in disturbances:
        draws = generator(seed, each.name, str(seen[each.name]))
        seen[each.name] += 1
        found.append(Acting(each, None if each.shape is Shape.STATED else Drawn(each, draws)))
    return found


@final
class Drawn:
    """A random course; what is later is drawn when it is first asked for, always in the same order."""

    def __init__(self, disturbance: Disturbance, draws: np.random.Generator) -> None:
        self._draws, self._back_s = draws, disturbance.back_s
        self._wanders = disturbance.shape is Shape.WANDERING
        self._least_s = disturbance.every_s
        self._more_s = max(disturbance.longest_s - disturbance.every_s, 0.0)
        self._begins, self._lasts, self._values = [0.0], [0.0], [0.0]

    def __call__(self, since_s: float) -> float:
        """Share at ``since_s`` [s, 0 or more] after its begin [1]."""
        while self._begins[-1] <= since_s:
            self._draw()
        k = bisect_right(self._begins, since_s)
        u = (since_s - self._begins[k - 1]) / self._lasts[k]
        if self._wanders:
            return self._values[k - 1] + (self._values[k] - self._values[k - 1]) * _eased(u)
        if u < 1.0:
            return u * u
        return 1.0 - _eased((u - 1.0) * self._lasts[k] / self._back_s)

    def _draw(self) -> None:
        lasts = self._least_s + self._more_s * self._draws.random()
        self._lasts.append(lasts)
        if self._wanders:
            self._values.append(self._draws.uniform(-1.0, 1.0))
        self._begins.append(self._begins[-1] + lasts + (0.0 if self._wanders else self._back_s))


def _eased(u: float) -> float:
    return u * u * (3.0 - 2.0 * u)
