"""Missed: what a plant in which nothing is wrong owes all the same, and for how long it has owed it."""

import math
from collections import deque
from collections.abc import Sequence

from homeostat.domain.events.deviations import Missed
from homeostat.domain.observation import Observation
from homeostat.domain.plant.limits import Criterion
from homeostat.domain.snapshot import Snapshot

KNOWN = 0.5
"""Share of the readings of a stretch that must be good for its mean to count [1]."""


class MissedCriteria:
    """Follows the criteria that ask for an improvement, each by its mean margin over the time that its row states.

    A mean, because one analyser's sample on the right side of a bound is no sign that the product is as ordered.
    """

    def __init__(self, criteria: Sequence[Criterion]) -> None:
        """``criteria`` state how long each may be missed."""
        self._means = [_Mean(criterion) for criterion in criteria]

    def follow(self, seen: Observation) -> Missed | None:
        """Take one more tick; the first criterion that is missed for too long, None where none is.

        While the plant is on its way, and where it has entered another state, the time begins anew.
        """
        if seen.entered or seen.rest.then or seen.latched is not None:
            self.forget()
        if seen.sample is None:
            return None
        found = [mean.take(seen.sample) for mean in self._means]
        return next((missed for missed in found if missed is not None), None)

    def forget(self) -> None:
        """Somebody was asked, or something was done: its effect is to be seen first."""
        for mean in self._means:
            mean.forget()


class _Mean:
    """Margin of one criterion over the last time."""

    def __init__(self, criterion: Criterion) -> None:
        assert criterion.asks_after_s is not None  # only those ask
        self._criterion, self._over_s = criterion, criterion.asks_after_s
        self._seen: deque[tuple[float, float]] = deque()

    def forget(self) -> None:
        self._seen.clear()

    def take(self, sample: Snapshot) -> Missed | None:
        formula, at_s = self._criterion.formula, sample.at_s
        known = not formula.tags & (sample.bad | sample.uncertain)
        self._seen.append((at_s, formula.margin_at(sample.values) if known else math.nan))
        if at_s - self._seen[0][0] < self._over_s:
            return None
        while at_s - self._seen[0][0] > self._over_s:
            self._seen.popleft()
        if self._seen[-1][1] >= 0.0:
            return None
        margins = [margin for _, margin in self._seen if not math.isnan(margin)]
        if len(margins) < KNOWN * len(self._seen):
            return None
        mean = sum(margins) / len(margins)
        return Missed(self._criterion.name, mean, formula.unit, self._over_s) if mean < 0.0 else None
