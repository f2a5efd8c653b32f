"""Effect: whether a fallback that stands brings a violated limit back, or at least nearer, in the time that it has.

The margin is followed over one period after another, each as long as the tables say that the strategy needs. In each
it must rise by more than its own noise: the slope of the least-squares line must be more than three times its standard
error. So the slowest return counts, and a reading that stands still does not. What cannot be judged has not improved.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from homeostat.domain.recovery import Effect, FallbackStrategy
from homeostat.guard.trips import LONGEST_S, Violation

SURE = 3.0
"""Standard errors by which a margin must rise."""
FEWEST = 3
"""Fewest readings that have a slope with an error."""
UNSTATED = Effect(75.0)
"""What is expected of a strategy about a limit of which its tables say nothing."""


@dataclass(slots=True)
class _Period:
    """Sums of one limit's margin over its period."""

    now_s: float
    passed_s: float = 0.0
    ticks: int = 0
    judged: int = 0
    t: float = 0.0
    tt: float = 0.0
    m: float = 0.0
    mm: float = 0.0
    tm: float = 0.0

    def add(self, now_s: float, margin: float) -> None:
        """One tick more; a clock that leaps ahead ends no period early."""
        self.passed_s += min(max(now_s - self.now_s, 0.0), LONGEST_S)
        self.now_s = now_s
        self.ticks += 1
        if math.isfinite(margin):
            t = self.passed_s
            self.judged += 1
            self.t, self.tt = self.t + t, self.tt + t * t
            self.m, self.mm, self.tm = self.m + margin, self.mm + margin * margin, self.tm + t * margin

    @property
    def known(self) -> bool:
        """Whether it was judged often enough to say anything."""
        return self.judged >= FEWEST and 2 * self.judged >= self.ticks

    @property
    def mean(self) -> float:
        """Mean margin, in its unit."""
        return self.m / self.judged

    @property
    def rises(self) -> bool:
        """Whether the margin rises by more than its noise."""
        n = self.judged
        spread = self.tt - self.t * self.t / n
        if spread <= 0.0:
            return False
        slope = (self.tm - self.t * self.m / n) / spread
        scatter = max(self.mm - self.m * self.m / n - slope * slope * spread, 0.0)
        return slope > SURE * math.sqrt(scatter / (n - 2) / spread)


class EffectWatch:
    """Follows every violated limit under the fallback that stands."""

    def __init__(self) -> None:
        """Nothing is followed yet."""
        self._periods: dict[str, _Period] = {}

    def clear(self) -> None:
        """Another strategy acts, or none."""
        self._periods.clear()

    def failed(
        self, now_s: float, strategy: FallbackStrategy, violations: Iterable[Violation]
    ) -> tuple[str, str] | None:
        """The first limit whose time is over and that ``strategy`` has not helped, and a sentence; None for none."""
        violated = {v.limit: v for v in violations}
        self._periods = {name: p for name, p in self._periods.items() if name in violated}
        found = None
        for name, violation in violated.items():
            effect = strategy.serves.get(name, UNSTATED)
            period = self._periods.setdefault(name, _Period(now_s))
            period.add(now_s, violation.margin)
            if period.passed_s < effect.acts_within_s:
                continue
            del self._periods[name]
            why = _objection(period, effect, violation.unit)
            if why and found is None:
                text = f"{strategy.name!r} has stood for {period.passed_s:g} s and does not help: {why}"
                found = name, f"{text}: {violation.reason}"
        return found


def _objection(period: _Period, effect: Effect, unit: str) -> str:
    """What a period says against a strategy; empty where it helps."""
    if not period.known:
        return "the limit cannot be judged"
    if period.mean >= -effect.rest or period.rises:
        return ""
    return f"the margin, {period.mean:.4g} {unit} on average, does not rise"
