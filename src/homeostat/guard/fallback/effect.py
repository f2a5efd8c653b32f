"""Effect: whether a fallback that stands brings a violated limit back, or at least nearer, in the time that it has.

The margin is followed over one period after another, each as long as the tables say that the strategy needs. In each
it must rise by more than its own noise: the slope of the least-squares line must be more than three times its standard
error. So the slowest return counts, and a reading that stands still does not. What was violated and cannot be judged
any more has not improved. Of what nothing has shown to be violated nobody knows whether a strategy helps, and that is
no evidence that it does not: no other strategy makes a reading readable.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from homeostat.domain.events.trips import EffectFollowed
from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.domain.recovery import Effect, FallbackStrategy
from homeostat.guard.fallback.trial import Passed
from homeostat.guard.watch.trips import LONGEST
from homeostat.guard.watch.violations import Violation

SURE = 3.0
"""Standard errors by which a margin must rise."""
FEWEST = 3
"""Fewest readings that have a slope with an error."""
SHARE = 8
"""How often in a period it is journalled how far it has come, at least; more often where that were 5 s or more."""
UNSTATED_S = 600.0
"""What is expected where the tables say of no strategy that it brings a limit back."""


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
    told_s: float = -math.inf

    @classmethod
    def of(cls, passed: Passed) -> _Period:
        """One that goes on after a death."""
        ticks, judged, *sums = passed.sums
        return cls(passed.at_s, passed.passed_s, int(ticks), int(judged), *sums)

    @property
    def sums(self) -> tuple[float, ...]:
        """What was seen of the margin, as it is journalled."""
        return (float(self.ticks), float(self.judged), self.t, self.tt, self.m, self.mm, self.tm)

    def add(self, now_s: float, margin: float, longest_s: float) -> None:
        """One tick more; a clock that leaps ahead ends no period early, and counts for ``longest_s`` at most [s]."""
        self.passed_s += min(max(now_s - self.now_s, 0.0), longest_s)
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

    def __init__(self, strategies: Iterable[FallbackStrategy], timing: Timing = REFERENCE) -> None:
        """``timing``: that of the plant.

        A strategy that is not said to bring a limit back has as long as those of ``strategies`` that are.
        """
        self._longest_s, self._unstated = LONGEST * timing.tick_s, Effect(timing.time_s(UNSTATED_S))
        stated: dict[str, float] = {}
        for strategy in strategies:
            for name, effect in strategy.serves.items():
                stated[name] = max(stated.get(name, effect.acts_within_s), effect.acts_within_s)
        self._stated = {name: Effect(acts_within_s) for name, acts_within_s in stated.items()}
        self._periods: dict[str, _Period] = {}

    def clear(self) -> None:
        """Another strategy acts, or none."""
        self._periods.clear()

    def restore(self, effects: Mapping[str, Passed]) -> None:
        """Go on after a death: the time without the guard counts as one tick does."""
        self._periods = {name: _Period.of(passed) for name, passed in effects.items()}

    def news(self, strategy: FallbackStrategy) -> tuple[EffectFollowed, ...]:
        """How far the time of each violated limit has come, where a death would lose too much of it."""
        found = []
        for name, period in self._periods.items():
            every_s = min(self._effect(strategy, name).acts_within_s / SHARE, self._longest_s)
            if period.passed_s - period.told_s >= every_s:
                period.told_s = period.passed_s
                found.append(EffectFollowed(strategy.name, name, period.now_s, period.passed_s, period.sums))
        return tuple(found)

    def failed(
        self, now_s: float, strategy: FallbackStrategy, violations: Iterable[Violation]
    ) -> tuple[str, str] | None:
        """The first limit whose time is over and that ``strategy`` has not helped, and a sentence; None for none."""
        violated = {v.limit: v for v in violations if v.seen}
        self._periods = {name: p for name, p in self._periods.items() if name in violated}
        found = None
        for name, violation in violated.items():
            effect = self._effect(strategy, name)
            period = self._periods.setdefault(name, _Period(now_s))
            period.add(now_s, violation.margin, self._longest_s)
            if period.passed_s < effect.acts_within_s:
                continue
            del self._periods[name]
            why = _objection(period, effect, violation.unit)
            if why and found is None:
                text = f"{strategy.name!r} has stood for {period.passed_s:g} s and does not help: {why}"
                found = name, f"{text}: {violation.reason}"
        return found

    def _effect(self, strategy: FallbackStrategy, limit: str) -> Effect:
        return strategy.serves.get(limit, self._stated.get(limit, self._unstated))


def _objection(period: _Period, effect: Effect, unit: str) -> str:
    """What a period says against a strategy; empty where it helps."""
    if not period.known:
        return "the limit cannot be judged"
    if period.mean >= -effect.rest or period.rises:
        return ""
    return f"the margin, {period.mean:.4g} {unit} on average, does not rise"
