"""Quality of readings: good, uncertain or bad, with the reason (OPC UA Part 8, NAMUR NE 107)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from homeostat.domain.guard_events import QualityChanged
from homeostat.domain.ports import GuardEvent
from homeostat.domain.rules import QualityRule
from homeostat.domain.snapshot import Quality, Snapshot
from homeostat.domain.tag import Tag

SIGMAS = 6.0 * math.sqrt(2.0)
"""Noise of a difference of two readings that is not taken for a step [standard deviations of one reading]."""
SLACK = 0.02
"""How far outside its range an instrument may read before it is not believed [fraction of the span]."""


@dataclass(slots=True)
class _Seen:
    """What is remembered of one tag."""

    value: float = math.nan
    taken_s: float = -math.inf
    changed_s: float = -math.inf
    uncertain_until_s: float = -math.inf
    quality: Quality = Quality.GOOD
    reason: str = ""


class QualityWatch:
    """Judges every reading of every sample; a bad one has no value any more (NaN)."""

    def __init__(
        self, rules: Mapping[str, QualityRule], tags: Mapping[str, Tag], note: Callable[[GuardEvent, float], None]
    ) -> None:
        """``rules``: tag -> when its reading may be believed; ``note`` journals an event at a process time [s]."""
        self._rules, self._tags, self._note = rules, tags, note
        self._seen = {tag: _Seen() for tag in rules}
        self._last: Snapshot | None = None
        self._late = ""

    @property
    def trouble(self) -> str:
        """Why the last tick brought no usable sample; empty where it did."""
        return self._late

    def assess(self, now_s: float, sample: Snapshot | None) -> Snapshot | None:
        """The readings that are valid at ``now_s`` [s], with their quality; None before the first sample."""
        self._late = self._unusable(now_s, sample)
        if sample is not None and not self._late:
            self._last = sample
            for tag in self._rules:
                self._take(tag, sample, now_s)
        if self._last is None:
            return None
        return self._judged(now_s, self._last, fresh=not self._late)

    def _unusable(self, now_s: float, sample: Snapshot | None) -> str:
        if sample is None:
            return "no sample came"
        if not math.isfinite(sample.at_s):
            return f"the sample's time is {sample.at_s!r} s"
        if not 0.0 <= sample.at_s <= now_s + 1e-6:
            return f"the sample is of {sample.at_s:g} s; it is {now_s:g} s now"
        if self._last is not None and sample.at_s <= self._last.at_s:
            return f"the sample of {sample.at_s:g} s is no newer than the one before ({self._last.at_s:g} s)"
        return ""

    def _take(self, tag: str, sample: Snapshot, now_s: float) -> None:
        """Remember a new value; one that is not newer than the last leaves that one to grow old."""
        seen, rule = self._seen[tag], self._rules[tag]
        taken_s = sample.taken_s.get(tag, sample.at_s)
        value = _number(sample.values.get(tag))
        newer = seen.taken_s < taken_s <= now_s + 1e-6
        if tag in sample.bad or not math.isfinite(value) or not newer:
            return
        if value != seen.value:
            seen.changed_s = taken_s
        if rule.fastest is not None and math.isfinite(seen.value):
            possible = rule.fastest * (taken_s - seen.taken_s) + SIGMAS * (rule.noise or 0.0)
            # A reading that steps again and again is no excuse for ever: between two grace times the raw one counts.
            if abs(value - seen.value) > possible and now_s >= seen.uncertain_until_s + rule.grace_s:
                seen.uncertain_until_s = now_s + rule.grace_s
        seen.value, seen.taken_s = value, taken_s

    def _judged(self, now_s: float, sample: Snapshot, fresh: bool) -> Snapshot:
        values = {tag: _number(value) for tag, value in sample.values.items()}
        bad, uncertain, reasons = set[str](), set[str](), dict[str, str]()
        for tag, rule in self._rules.items():
            quality, reason = self._quality(tag, rule, now_s, sample, fresh)
            seen = self._seen[tag]
            values[tag] = math.nan if quality is Quality.BAD else seen.value
            if quality is not Quality.GOOD:
                (bad if quality is Quality.BAD else uncertain).add(tag)
                reasons[tag] = reason
            if quality is not seen.quality:
                seen.quality, seen.reason = quality, reason
                self._note(QualityChanged(tag, quality.value, reason), now_s)
        return Snapshot(
            sample.at_s, values, frozenset(bad), frozenset(uncertain), reasons, dict(sample.taken_s),
            dict(sample.accepted),
        )  # fmt: skip

    def _quality(self, tag: str, rule: QualityRule, now_s: float, sample: Snapshot, fresh: bool) -> tuple[Quality, str]:
        """How far the reading of ``tag`` can be trusted, and why not further."""
        seen, unit = self._seen[tag], self._tags[tag].unit
        if fresh and tag not in sample.values:
            return Quality.BAD, f"{tag!r} is missing from the sample"
        if fresh and tag in sample.bad:
            return Quality.BAD, f"{tag!r} is marked bad: {sample.reasons.get(tag, 'no reason is given')}"
        if fresh and not math.isfinite(_number(sample.values[tag])):
            return Quality.BAD, f"{tag!r} is not a number"
        age_s = now_s - seen.taken_s
        if not 0.0 <= age_s <= rule.stale_s:
            return Quality.BAD, f"{tag!r} is {age_s:g} s old; at most {rule.stale_s:g} s are allowed"
        within = self._tags[tag].range
        slack = SLACK * within.span
        if not within.low - slack <= seen.value <= within.high + slack:
            text = f"{tag!r} = {seen.value:.6g} {unit} is outside its instrument's range"
            return Quality.BAD, f"{text} {within.low:g} to {within.high:g} {unit}"
        if rule.frozen_s is not None and now_s - seen.changed_s >= rule.frozen_s:
            return Quality.BAD, f"{tag!r} has been exactly {seen.value:.6g} {unit} for {rule.frozen_s:g} s: frozen"
        if now_s < seen.uncertain_until_s:
            return Quality.UNCERTAIN, f"{tag!r} moved faster than {rule.fastest:g} {unit}/s"
        if tag in sample.uncertain:
            return Quality.UNCERTAIN, f"{tag!r} is marked uncertain: {sample.reasons.get(tag, 'no reason is given')}"
        return Quality.GOOD, ""


def _number(value: object) -> float:
    """``value`` as a float; NaN where it is none."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
