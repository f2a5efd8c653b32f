"""Band: between what the instruments should show with what is held to be wrong, and whether they do.

Symptoms compare a plant with a healthy one, and say nothing new where a further fault, a growing one or the end of one
moves what is off already. What is held to be wrong predicts more: every member of a rollout says what is to be shown,
and a reading that leaves all of them is explained by none.
"""

import math
from collections import deque
from collections.abc import Iterable, Mapping

import numpy as np

from homeostat.domain.events.recovery import Strayed
from homeostat.domain.plant.tag import Tag
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Rollout
from homeostat.recovery.bounds import InterventionBounds

FIRST, LONGEST = 2.0, 20.0
"""How long there is no call after one, at first and at most, as it doubles each time, in times of averaging [1]."""


class Band:
    """Follows the readings of some tags beside what was predicted of them."""

    def __init__(self, watched: Iterable[str], tags: Mapping[str, Tag], bounds: InterventionBounds) -> None:
        """``watched``: tags by which the plant is protected; others tell sooner that something is wrong, and less."""
        self._tags = {name: tags[name] for name in sorted(set(watched)) if name in tags}
        self._further, self._mean_s = bounds.stray, bounds.stray_s
        self._predicted: Rollout | None = None
        self._from_s, self._lying = -math.inf, frozenset[str]()
        self._seen: deque[Snapshot] = deque()
        self._quiet_until_s, self._wait_s = -math.inf, FIRST * bounds.stray_s

    def expect(self, rollout: Rollout, lying: Iterable[str]) -> None:
        """From its beginning on the plant does what ``rollout`` says; what instruments are ``lying`` about is not seen.

        Where nothing is held to be wrong, nothing is expected: that readings show a healthy plant is monitoring's part.
        """
        faulty = any(h.faults for h in rollout.hypotheses)
        self._predicted = rollout if faulty and rollout.weights else None
        self._from_s, self._lying = rollout.trajectory.start_s, frozenset(lying)

    def forget(self) -> None:
        """Nothing is expected any more: the plant is moved otherwise."""
        self._predicted = None

    def strays(self, seen: Snapshot) -> Strayed | None:
        """The tag whose mean is furthest outside its band, by more than errors of the model; None where none is."""
        self._seen.append(seen)
        while self._seen and self._seen[0].at_s <= seen.at_s - self._mean_s:
            self._seen.popleft()
        rollout, since_s = self._predicted, self._seen[0].at_s if self._seen else math.inf
        if rollout is None or seen.at_s < self._quiet_until_s or since_s < self._from_s:
            return None
        if seen.at_s > rollout.trajectory.times_s[-1] or seen.at_s - since_s < 0.5 * self._mean_s:
            return None
        found = [s for name, tag in self._tags.items() if (s := self._strayed(rollout, name, tag)) is not None]
        if not found:
            return None
        longest_s = LONGEST * self._mean_s
        calm = seen.at_s - self._quiet_until_s > longest_s
        self._wait_s = FIRST * self._mean_s if calm else min(2.0 * self._wait_s, longest_s)
        self._quiet_until_s = seen.at_s + self._wait_s
        return max(found, key=lambda s: max(s.low - s.mean, s.mean - s.high) / self._tags[s.tag].scale)

    def _strayed(self, rollout: Rollout, name: str, tag: Tag) -> Strayed | None:
        signals, times_s = rollout.trajectory.signals, rollout.trajectory.times_s
        if name in self._lying or name not in signals:
            return None
        good = [
            s for s in self._seen if math.isfinite(s.values.get(name, math.nan)) and name not in s.bad | s.uncertain
        ]
        if len(good) < 0.5 * len(self._seen) or not good:
            return None
        at_s = np.array([s.at_s for s in good])
        mean = float(np.mean([s.values[name] for s in good]))
        members = [float(np.interp(at_s, times_s, member).mean()) for member in signals[name]]
        low, high = min(members), max(members)
        if low - self._further * tag.scale <= mean <= high + self._further * tag.scale:
            return None
        text = f"{name} is at {mean:.4g} {tag.unit}, predicted {low:.4g} to {high:.4g} {tag.unit}"
        return Strayed(name, mean, low, high, f"{text} with what is held to be wrong")
