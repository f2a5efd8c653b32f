"""Instruments that are out: an alarm for each, so that somebody mends what limits do without meanwhile."""

from __future__ import annotations

from collections.abc import Mapping

from homeostat.domain.alarm import Priority
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.alarms import Alarms

LASTS = 2.0
"""A reading that is bad for so many times as long as it may be old is no dropout [1]."""
MOST = 5
"""Most alarms of one reading each; more have a cause in common, and one alarm names them all."""
ALL = "readings"
"""The alarm of many."""


class Instruments:
    """Raises and ends the alarms of readings that stay bad while others come."""

    def __init__(self, rules: Mapping[str, QualityRule], alarms: Alarms) -> None:
        """``rules`` by tag; no reading is bad yet."""
        self._rules, self._alarms = rules, alarms
        self._since_s: dict[str, float] = {}
        self._named: set[str] = set()

    def judge(self, readings: Snapshot, now_s: float) -> None:
        """What of the ``readings`` of a sample that came is bad, and since when."""
        bad = readings.bad & self._rules.keys()
        self._since_s = {tag: self._since_s.get(tag, now_s) for tag in bad}
        lasting = sorted(t for t in bad if now_s - self._since_s[t] >= LASTS * self._rules[t].stale_s)
        for tag in self._named - set(lasting):
            self._alarms.return_(f"reading:{tag}", now_s)
        self._named &= set(lasting)
        if len(lasting) > MOST:
            text = f"{len(lasting)} of {len(self._rules)} readings are bad: {', '.join(lasting)}"
            self._alarms.raise_(ALL, text, Priority.HIGH, now_s)
            return
        self._alarms.return_(ALL, now_s)
        for tag in lasting:
            self._alarms.raise_(f"reading:{tag}", readings.reasons.get(tag, f"{tag!r} is bad"), Priority.MEDIUM, now_s)
        self._named |= set(lasting)
