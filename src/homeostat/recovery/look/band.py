"""Band: how near its hard limits a plant should be with what is held to be wrong, and whether it is nearer.

Symptoms compare a plant with a healthy one, and say nothing new where a further fault or a growing one moves what is
off already. What is held to be wrong predicts more: every member of a rollout says how much of each margin is left, and
a plant that has less of one than any member is explained by none.
"""

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from homeostat.domain.events.deviations import Strayed
from homeostat.domain.plant.limits import Limit
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Rollout
from homeostat.process.types import Vec
from homeostat.recovery.bounds import InterventionBounds

FIRST, LONGEST = 2.0, 20.0
"""How long there is no call after one, at first and at most, as it doubles each time, in times of averaging [1]."""
SHARE = 0.25
"""Share of a predicted margin that must be gone as well: far from a limit the model may be wrong by more [1]."""


class Band:
    """Follows the margins of hard limits beside what was predicted of them."""

    def __init__(self, limits: Sequence[Limit], scales: Mapping[str, float], bounds: InterventionBounds) -> None:
        """``scales``: unit -> what counts as one unit of margin in it."""
        # One that looks into the future has no margin now, and is left to whoever watches it over time.
        self._limits = {limit.name: limit for limit in limits if limit.formula.horizon_s == 0.0}
        self._scales = scales
        self._further, self._mean_s = bounds.stray, bounds.stray_s
        self._least: dict[str, Vec] = {}
        self._times_s = np.empty(0)
        self._seen: deque[tuple[float, dict[str, float]]] = deque()
        self._quiet_until_s, self._wait_s = -math.inf, FIRST * bounds.stray_s

    def expect(self, rollout: Rollout, lying: Iterable[str]) -> None:
        """From its beginning on the plant keeps the margins of ``rollout``; of what may be ``lying`` nobody knows.

        Where nothing is held to be wrong, nothing is expected: that readings show a healthy plant is monitoring's part.
        """
        self.forget()
        if not math.isfinite(self._further) or not any(h.faults for h in rollout.hypotheses) or not rollout.weights:
            return
        signals, dt_s = rollout.trajectory.signals, rollout.trajectory.dt_s
        self._times_s, unknown = rollout.trajectory.times_s, set(lying)
        for name, limit in self._limits.items():
            if limit.formula.tags <= signals.keys() and not limit.formula.tags & unknown:
                self._least[name] = np.atleast_2d(limit.formula.margins(signals, dt_s)).min(axis=0)

    def forget(self) -> None:
        """Nothing is expected any more: the plant is moved otherwise."""
        self._least = {}

    def strays(self, seen: Snapshot) -> Strayed | None:
        """The limit of which furthest less is left than was predicted, by more than the model errs; None for none."""
        at_s, doubted = seen.at_s, seen.bad | seen.uncertain
        told = {n: x.formula.margin_at(seen.values) for n, x in self._limits.items() if not x.formula.tags & doubted}
        self._seen.append((at_s, {n: margin for n, margin in told.items() if math.isfinite(margin)}))
        while self._seen[0][0] <= at_s - self._mean_s:
            self._seen.popleft()
        since_s = self._seen[0][0]
        if not self._least or at_s < self._quiet_until_s or at_s - since_s < 0.5 * self._mean_s:
            return None
        if since_s < self._times_s[0] or at_s > self._times_s[-1]:
            return None
        found = [s for name in self._least if (s := self._strayed(name)) is not None]
        if not found:
            return None
        longest_s = LONGEST * self._mean_s
        calm = at_s - self._quiet_until_s > longest_s
        self._wait_s = FIRST * self._mean_s if calm else min(2.0 * self._wait_s, longest_s)
        self._quiet_until_s = at_s + self._wait_s
        return max(found, key=lambda s: (s.least - s.margin) / self._scale(s.limit))

    def _scale(self, name: str) -> float:
        return self._scales.get(self._limits[name].formula.unit, 1.0)

    def _strayed(self, name: str) -> Strayed | None:
        good = [(at_s, margins[name]) for at_s, margins in self._seen if name in margins]
        if not good or len(good) < 0.5 * len(self._seen):
            return None
        times_s, margins = np.array(good).T
        mean, least = float(margins.mean()), float(np.interp(times_s, self._times_s, self._least[name]).mean())
        if not mean < least - max(self._further * self._scale(name), SHARE * least):  # what is undecided says nothing
            return None
        limit = self._limits[name].formula
        text = f"{limit.text!r} holds by {mean:.4g} {limit.unit} ({name}), predicted to hold by {least:.4g} at least"
        return Strayed(name, mean, least, f"{text} with what is held to be wrong")
