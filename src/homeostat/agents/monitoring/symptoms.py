"""Symptoms: deviations of features from their reference that last."""

import math
from collections.abc import Iterable

from homeostat.domain.diagnosis import Direction, Symptom, SymptomRule
from homeostat.domain.plant.baseline import Baseline

FOLLOWED = 2.0
"""How far what is learned may move, in standard deviations of how much healthy plants of one design differ [1]."""


class SymptomWatch:
    """Applies one rule: threshold and on-delay; a symptom returns at 70 % of the threshold."""

    def __init__(self, rule: SymptomRule, baseline: Baseline) -> None:
        """``baseline`` is the reference of the rule's feature."""
        self.rule = rule
        self._baseline = baseline
        self._centre = baseline.mean
        self._sd = math.hypot(baseline.within_sd, baseline.between_sd)
        self._learned: float | None = None
        self._since: float | None = None
        self.active: Symptom | None = None
        """The confirmed symptom; None while there is none."""
        self.size = 0.0
        """The last deviation on the side that counts, as a multiple of the threshold [1]."""

    def centre(self, mean: float) -> None:
        """Use this plant's own healthy mean; refused (kept at the design's) where it is implausible."""
        if abs(mean - self._baseline.mean) <= 4.0 * self._sd:
            self._centre = self._learned = mean
            self._sd = self._baseline.within_sd

    def follow(self, value: float, share: float) -> None:
        """Let the plant's own mean follow ``value`` by a ``share`` of its distance [1], where one was learned.

        It moves no further than healthy plants differ by what the tables leave uncertain: a fault that grows slowly is
        not learned away.
        """
        if self._learned is not None:
            most = FOLLOWED * self._baseline.between_sd
            moved = self._centre + share * (value - self._centre)
            self._centre = min(max(moved, self._learned - most), self._learned + most)

    @property
    def threshold(self) -> float:
        """Least deviation that counts, in the feature's unit."""
        return max(self.rule.sigma * self._sd, self.rule.threshold)

    @property
    def pending(self) -> bool:
        """Whether the deviation is there, confirmed or not."""
        return self._since is not None

    def excess(self, value: float) -> float:
        """Deviation of ``value`` on the side that counts, as a multiple of the threshold [1]."""
        deviation = value - self._centre
        match self.rule.direction:
            case Direction.HIGH:
                signed = deviation
            case Direction.LOW:
                signed = -deviation
            case Direction.BOTH:
                signed = abs(deviation)
        return signed / self.threshold

    def least_excess(self, values: Iterable[float]) -> float:
        """The least that it is of anything between ``values`` [1]."""
        every = tuple(values)
        return self.excess(min(max(self._centre, min(every)), max(every)))

    def update(self, value: float, at_s: float) -> Symptom | None:
        """The confirmed symptom after one more value, or None."""
        deviation = value - self._centre
        self.size = excess = self.excess(value)
        if excess >= 1.0:
            self._since = at_s if self._since is None else self._since
            if at_s - self._since >= self.rule.on_delay_s and self.active is None:
                self.active = Symptom(self.rule.name, at_s, deviation, self.threshold, excess)
        elif excess < 0.7:
            self._since = None
            self.active = None
        return self.active
