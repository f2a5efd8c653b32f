"""Trip limits: watched on what instruments say and on what a diagnosis says they mean, by cumulative sums.

A single noisy reading above its limit is no violation, a lasting one must not wait for a slow filter. So every limit
has a cumulative sum (Page, Biometrika 41, 1954) of its violation over time, S := max(0, S - margin dt), and trips when
S exceeds what the table allows [unit of the margin times s].
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from homeostat.domain.guard_events import TripLifted
from homeostat.domain.limits import Limit
from homeostat.domain.ports import GuardEvent
from homeostat.domain.rules import GuardRules, TripRule
from homeostat.domain.snapshot import Snapshot

NEAR = 0.5
"""Share of its allowance that a limit may have used up while something is still released [1]."""


@dataclass(frozen=True, slots=True)
class Violation:
    """One hard limit that is violated, or that cannot be judged any more."""

    limit: str
    """Name of the limit."""
    margin: float
    """Margin that trips, in ``unit``; NaN where it cannot be judged."""
    unit: str
    """Unit of the margin."""
    reason: str
    """One sentence."""


@dataclass(slots=True)
class _Watched:
    """What is remembered of one limit."""

    raw: float = 0.0
    corrected: float = 0.0
    blind_since_s: float | None = None
    lifted_s: float = 0.0
    lifting: bool = False


class TripWatch:
    """Judges every hard limit once per tick, whether or not anything is latched."""

    def __init__(self, rules: GuardRules, note: Callable[[GuardEvent, float], None]) -> None:
        """``note`` journals an event at a process time [s]."""
        self._rules, self._note = rules, note
        self._watched = {limit.name: _Watched() for limit in rules.limits.hard}
        self._errors: tuple[Mapping[str, float], ...] = ({},)
        self._at_s: float | None = None
        self._starting = True

    def correct(self, errors: tuple[Mapping[str, float], ...]) -> None:
        """Take note of instrument errors: per plausible explanation tag -> reading minus truth; not finite is none."""
        clean = tuple({t: e for t, e in error.items() if math.isfinite(e)} for error in errors)
        self._errors = clean or ({},)

    def judge(self, now_s: float, readings: Snapshot | None, state: str) -> tuple[Violation, ...]:
        """Every violated hard limit at ``now_s`` [s] in ``state``; ``readings`` are judged for quality already."""
        dt_s = 0.0 if self._at_s is None else max(now_s - self._at_s, 0.0)
        self._at_s = now_s
        starting = state in self._rules.start_up.states
        if self._starting and not starting:
            self._watched = {name: _Watched() for name in self._watched}
        self._starting = starting
        found = []
        for limit in self._rules.limits.hard:
            in_force = self._rules.start_up.limits.get(limit.name, limit) if starting else limit
            found.append(self._judge(in_force, limit.name, readings, now_s, dt_s or 1.0))
        return tuple(v for v in found if v is not None)

    def near(self, readings: Snapshot) -> tuple[Violation, ...]:
        """Hard limits that forbid a release on these ``readings``: undecided, or half way to a trip."""
        found = []
        for limit in self._rules.limits.hard:
            watched, rule = self._watched[limit.name], self._rules.trips[limit.name]
            margin = limit.formula.margin_at(readings.values)
            used = max(watched.raw, watched.corrected)
            near = not watched.lifting and (used > NEAR * rule.cusum or (rule.cusum == 0.0 and margin < 0.0))
            if math.isnan(margin) or near:
                found.append(_violation(limit, limit.name, margin))
        return tuple(found)

    def _judge(self, limit: Limit, name: str, readings: Snapshot | None, now_s: float, dt_s: float) -> Violation | None:
        watched, rule = self._watched[name], self._rules.trips[name]
        values = {} if readings is None else readings.values
        carried = None if self._starting else self._carried(rule, readings)
        raw = limit.formula.margin_at(values)
        if readings is not None and carried is not None and limit.formula.tags & readings.uncertain:
            raw = carried
        if math.isnan(raw):
            return self._blind(limit, name, rule, watched, now_s)
        watched.blind_since_s = None
        margins = [limit.formula.margin_at(_corrected(values, errors)) for errors in self._errors if errors]
        corrected = min((m for m in margins if not math.isnan(m)), default=raw)
        watched.raw = _cumulated(watched.raw, raw, dt_s, rule.cusum)
        watched.corrected = _cumulated(watched.corrected, corrected, dt_s, rule.cusum)
        if corrected < 0.0 and watched.corrected > rule.cusum:
            return _violation(limit, name, corrected)
        if raw >= 0.0:
            watched.lifting = False
        elif watched.raw > rule.cusum and not self._may_lift(rule, watched, corrected - raw, corrected, carried):
            return _violation(limit, name, raw)
        elif watched.raw > rule.cusum:
            self._lift(rule, watched, now_s, dt_s)
        return None

    def _blind(self, limit: Limit, name: str, rule: TripRule, watched: _Watched, now_s: float) -> Violation | None:
        if watched.blind_since_s is None:
            watched.blind_since_s = now_s
        for_s = now_s - watched.blind_since_s
        if for_s < rule.grace_s:
            return None
        text = f"{limit.formula.text!r} could not be judged for {for_s:g} s; {rule.grace_s:g} s are allowed ({name})"
        return Violation(name, math.nan, limit.formula.unit, text)

    def _carried(self, rule: TripRule, readings: Snapshot | None) -> float | None:
        """Margin of what carries the limit; None where nothing does, or not now."""
        if rule.carrier is None or readings is None or rule.carrier.tags & readings.uncertain:
            return None
        margin = rule.carrier.margin_at(readings.values)
        return None if math.isnan(margin) else margin

    def _may_lift(
        self, rule: TripRule, watched: _Watched, size: float, corrected: float, carried: float | None
    ) -> bool:  # fmt: skip
        """Whether a diagnosis may keep a reading from tripping: only where something else carries the limit."""
        refuted = all(self._errors)  # an empty mapping says that the readings may be right as they are
        bounded = size <= rule.lift and watched.lifted_s < rule.lift_s
        return refuted and bounded and corrected >= 0.0 and carried is not None and carried >= 0.0

    def _lift(self, rule: TripRule, watched: _Watched, now_s: float, dt_s: float) -> None:
        watched.lifted_s += dt_s
        if not watched.lifting and rule.carrier is not None:
            watched.lifting = True
            self._note(TripLifted(rule.limit, rule.carrier.text, now_s + rule.lift_s - watched.lifted_s), now_s)


def _cumulated(before: float, margin: float, dt_s: float, most: float) -> float:
    """The cumulative sum after ``dt_s`` more at ``margin``; it stops a little above what trips, so that it can fall."""
    return min(max(0.0, before - margin * dt_s), most + abs(margin) * dt_s)


def _corrected(values: Mapping[str, float], errors: Mapping[str, float]) -> dict[str, float]:
    return {tag: value - errors.get(tag, 0.0) for tag, value in values.items()}


def _violation(limit: Limit, name: str, margin: float) -> Violation:
    if math.isnan(margin):
        return Violation(name, margin, limit.formula.unit, f"{limit.formula.text!r} cannot be judged now ({name})")
    text = f"{limit.formula.text!r} is violated by {-margin:.4g} {limit.formula.unit} ({name})"
    return Violation(name, margin, limit.formula.unit, text)
