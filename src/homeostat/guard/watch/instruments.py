"""Instruments that are out: an alarm for each, so that somebody mends what limits do without meanwhile."""

from __future__ import annotations

from collections.abc import Mapping

from homeostat.domain.alarm import Priority
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.alarms import Alarms

LASTS = 2.0
"""A reading that was bad for so many times as long as it may be old is no dropout [1]."""
MOST = 5
"""Most alarms of one reading each; more have a cause in common, and one alarm names them all."""
ALL = "readings"
"""The alarm of many."""


class Instruments:
    """Raises and ends the alarms of readings that stay bad, or are so most of the time, while others come."""

    def __init__(self, rules: Mapping[str, QualityRule], alarms: Alarms) -> None:
        """``rules`` by tag; no reading is bad yet."""
        self._rules, self._alarms = rules, alarms
        self._bad_s = dict.fromkeys(rules, 0.0)
        self._out = frozenset[str]()
        self._named = frozenset[str]()
        self._before_s: float | None = None

    def judge(self, readings: Snapshot, now_s: float) -> None:
        """What of the ``readings`` of a sample that came is bad: the time that it was comes back no faster.

        Of a gap between two samples no more counts than a reading may be old: nobody knows what it was meanwhile. An
        analyser of which so many samples in a row were the same is out at once: that is no dropout.
        """
        passed_s = 0.0 if self._before_s is None else max(now_s - self._before_s, 0.0)
        self._before_s = now_s
        for tag, rule in self._rules.items():
            counts_s = min(passed_s, rule.stale_s)
            bad_s = self._bad_s[tag] + (counts_s if tag in readings.bad else -counts_s)
            repeats = rule.every_s is not None and tag in readings.frozen_s
            self._bad_s[tag] = LASTS * rule.stale_s if repeats else min(max(bad_s, 0.0), LASTS * rule.stale_s)
        still = frozenset(tag for tag in self._out if self._bad_s[tag] > 0.0)
        self._out = still | {tag for tag, rule in self._rules.items() if self._bad_s[tag] >= LASTS * rule.stale_s}
        self._tell(readings, now_s)

    def _tell(self, readings: Snapshot, now_s: float) -> None:
        for tag in sorted(self._named - self._out):
            self._alarms.return_(f"reading:{tag}", now_s)
        self._named &= self._out
        if not self._out:
            self._alarms.return_(ALL, now_s)
        new = self._out - self._named
        if new and len(self._out) > MOST and not self._alarms.lasts(ALL):
            text = f"{len(self._out)} of {len(self._rules)} readings are bad: {', '.join(sorted(self._out))}"
            self._alarms.raise_(ALL, text, Priority.HIGH, now_s)
        else:
            for tag in sorted(new):
                reason = readings.reasons.get(tag, f"{tag!r} is bad again and again")
                self._alarms.raise_(f"reading:{tag}", reason, Priority.MEDIUM, now_s)
        self._named |= new
