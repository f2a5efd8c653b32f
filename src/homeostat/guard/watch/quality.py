"""Quality of readings: good, uncertain or bad, with the reason (OPC UA Part 8, NAMUR NE 107)."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from numbers import Real

from homeostat.domain.events.guard import QualityChanged, ReadingJumped
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.plant.tag import Tag
from homeostat.domain.ports import GuardEvent
from homeostat.domain.snapshot import Quality, Snapshot
from homeostat.guard.texts import said
from homeostat.guard.watch.jumps import Jumps, steps

SLACK = 0.02
"""How far outside its range an instrument may read before it is bad [fraction of the span]."""
STALE_S = 10.0
"""Oldest sample that is still the present one where no tag has a rule [s]."""
AHEAD_S = 1e-6
"""How far a time may lie ahead of the guard's clock, for rounding [s]."""


@dataclass(slots=True)
class _Seen:
    """What is remembered of one tag."""

    value: float = math.nan
    taken_s: float = -math.inf
    changed_s: float = math.nan
    before: float = math.nan
    """Value before the step that made it uncertain."""
    uncertain_until_s: float = -math.inf
    quality: Quality = Quality.GOOD


class QualityWatch:
    """Judges every reading of every sample; a bad one has no value any more (NaN)."""

    def __init__(
        self,
        rules: Mapping[str, QualityRule],
        tags: Mapping[str, Tag],
        note: Callable[[GuardEvent, float], None],
        jumps: Jumps | None = None,
    ) -> None:
        """``rules``: tag -> when its reading is good or bad; ``note`` journals an event at a process time [s].

        ``jumps`` hear of every new reading.
        """
        self._rules, self._tags, self._note = rules, tags, note
        self._jumps = Jumps(rules) if jumps is None else jumps
        self._seen = {tag: _Seen() for tag in rules}
        each_tick = [rule.stale_s for rule in rules.values() if rule.every_s is None]
        self._stale_s = max(each_tick, default=STALE_S)
        self._last: Snapshot | None = None
        self._trouble = ""

    @property
    def trouble(self) -> str:
        """Why the last tick brought no usable sample; empty where it did."""
        return self._trouble

    def assess(self, now_s: float, sample: Snapshot | None) -> Snapshot | None:
        """The readings that are valid at ``now_s`` [s], with their quality; None before the first sample."""
        own = self._usable(now_s, sample)
        if own is not None:
            self._last = own
            for tag in self._rules:
                self._take(tag, own, now_s)
        if self._last is None:
            return None
        return self._judged(now_s, self._last)

    def _usable(self, now_s: float, sample: Snapshot | None) -> Snapshot | None:
        """A copy of ``sample`` that nobody else holds; None, and :attr:`trouble` says why, where it is of no use."""
        if sample is None:
            self._trouble = "no sample came"
            return None
        try:
            own = _copied(sample)
        except BaseException as error:  # a link may deliver anything
            self._trouble = f"the sample cannot be read: {said(error)}"
            return None
        self._trouble = self._untimely(now_s, own.at_s)
        return None if self._trouble else own

    def _untimely(self, now_s: float, at_s: float) -> str:
        if not 0.0 <= at_s <= now_s + AHEAD_S:
            return f"the sample is of {at_s:g} s; it is {now_s:g} s now"
        if self._last is not None and at_s <= self._last.at_s:
            return f"the sample of {at_s:g} s is no newer than the one before ({self._last.at_s:g} s)"
        return ""

    def _take(self, tag: str, sample: Snapshot, now_s: float) -> None:
        """Remember a new value; one that is not newer than the last leaves that one to grow old."""
        seen, rule = self._seen[tag], self._rules[tag]
        taken_s = sample.taken_s.get(tag, sample.at_s)
        value = sample.values.get(tag, math.nan)
        newer = seen.taken_s < taken_s <= now_s + AHEAD_S
        if tag in sample.bad or not math.isfinite(value) or not newer:
            return
        if self._jumps.take(tag, value, taken_s):
            self._note(ReadingJumped(tag, self._jumps.by(tag)), now_s)
        # What an analyser shows in the tick before its next sample is as old as that sample.
        before_s = seen.taken_s if rule.every_s is None else seen.changed_s
        if value != seen.value:
            seen.changed_s = taken_s
        if now_s < seen.uncertain_until_s:
            if not steps(rule, value - seen.before, 0.0):
                seen.uncertain_until_s = now_s  # one wild value: the reading goes on from where it was before
        # A reading that steps again and again is no excuse for ever: between two grace times the raw one counts.
        elif now_s >= seen.uncertain_until_s + rule.grace_s and steps(rule, value - seen.value, taken_s - before_s):
            seen.before = seen.value
            seen.uncertain_until_s = now_s + rule.grace_s
        seen.value, seen.taken_s = value, taken_s

    def _judged(self, now_s: float, sample: Snapshot) -> Snapshot:
        old = now_s - sample.at_s > self._stale_s
        values, reasons = dict(sample.values), dict(sample.reasons)
        bad = set(sample.values if old else sample.bad) - self._rules.keys()
        uncertain = set(sample.uncertain) - self._rules.keys()
        values.update(dict.fromkeys(bad, math.nan))
        for tag, rule in self._rules.items():
            quality, reason = self._quality(tag, rule, now_s, sample)
            seen = self._seen[tag]
            values[tag] = math.nan if quality is Quality.BAD else seen.value
            reasons.pop(tag, None)
            if quality is not Quality.GOOD:
                (bad if quality is Quality.BAD else uncertain).add(tag)
                reasons[tag] = reason
            if quality is not seen.quality:
                seen.quality = quality
                self._note(QualityChanged(tag, quality.value, reason), now_s)
        accepted = {} if old else dict(sample.accepted)  # what the plant held long ago is not known to be held
        return Snapshot(
            sample.at_s,
            values,
            frozenset(bad),
            frozenset(uncertain),
            reasons,
            dict(sample.taken_s),
            {tag: self._seen[tag].changed_s for tag in bad & self._rules.keys() if self._is_frozen(tag)},
            accepted,
        )

    def _repeats(self, tag: str, now_s: float) -> bool:
        """Whether ``tag`` has noise and has shown the same to the last digit for longer than it may."""
        rule, seen = self._rules[tag], self._seen[tag]
        if not rule.noise or rule.frozen_s is None:
            return False
        # A sample of an analyser may be told late; only what has come says that it repeats itself.
        until_s = now_s if rule.every_s is None else seen.taken_s
        return until_s - seen.changed_s >= rule.frozen_s

    def _is_frozen(self, tag: str) -> bool:
        """Whether new readings of ``tag`` went on coming for as long; what has stopped coming is silent, not frozen."""
        return self._repeats(tag, self._seen[tag].taken_s)

    def _quality(self, tag: str, rule: QualityRule, now_s: float, sample: Snapshot) -> tuple[Quality, str]:
        """How far the reading of ``tag`` can be trusted, and why not further."""
        seen, unit = self._seen[tag], self._tags[tag].unit
        if tag not in sample.values:
            return Quality.BAD, f"{tag!r} is missing from the sample"
        if tag in sample.bad:
            return Quality.BAD, f"{tag!r} is marked bad: {sample.reasons.get(tag, 'no reason is given')}"
        if not math.isfinite(sample.values[tag]):
            return Quality.BAD, f"{tag!r} is not a number"
        age_s = now_s - seen.taken_s
        if age_s > rule.stale_s:
            return Quality.BAD, f"{tag!r} is {age_s:g} s old; at most {rule.stale_s:g} s are allowed"
        within = self._tags[tag].range
        slack = SLACK * within.span
        if not within.low - slack <= seen.value <= within.high + slack:
            text = f"{tag!r} = {seen.value:.6g} {unit} is outside its instrument's range"
            return Quality.BAD, f"{text} {within.low:g} to {within.high:g} {unit}"
        if self._repeats(tag, now_s):
            return Quality.BAD, f"{tag!r} has been exactly {seen.value:.6g} {unit} for {rule.frozen_s:g} s: frozen"
        if now_s < seen.uncertain_until_s:
            return Quality.UNCERTAIN, f"{tag!r} moved faster than {rule.fastest:g} {unit}/s"
        if tag in sample.uncertain:
            return Quality.UNCERTAIN, f"{tag!r} is marked uncertain: {sample.reasons.get(tag, 'no reason is given')}"
        return Quality.GOOD, ""


def _copied(sample: Snapshot) -> Snapshot:
    """``sample`` made of plain numbers and texts of its own; a target that is no number is not told."""
    targets = {tag: None if value is None else _number(value) for tag, value in sample.accepted.items()}
    return Snapshot(
        _number(sample.at_s),
        {tag: _number(value) for tag, value in sample.values.items()},
        frozenset(sample.bad),
        frozenset(sample.uncertain),
        {tag: str(reason)[:200] for tag, reason in sample.reasons.items()},
        {tag: _number(taken_s) for tag, taken_s in sample.taken_s.items()},
        {},  # whether a reading repeats itself is judged here, whatever a link says
        {tag: target for tag, target in targets.items() if target is None or math.isfinite(target)},
    )


def _number(value: object) -> float:
    """``value`` as a float; NaN where it is none, or is too large for one."""
    if type(value) is float:  # nearly always, and many times a tick
        return value
    if type(value) is bool or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.nan
