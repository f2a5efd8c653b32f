"""Recurring: symptoms that come and go by themselves, how large they were and how long they stood.

A disturbance that swings is explained anew at every turn by whatever fits the last of it, and what grows is rolled out
as growing on. What it did before says more: where a symptom has come and gone while nobody moved anything, one that is
no larger and stands no longer is expected to go as well. Only what stood under the commands of now counts, because
elsewhere the limits are nearer or further.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

from homeostat.agents.monitoring.symptoms import SymptomWatch
from homeostat.domain.diagnosis import FaultState, Recurrence
from homeostat.domain.snapshot import Snapshot

TIMES = 2
"""How often one of the symptoms must have come and gone by itself, while each of the others did once [1]."""
LARGER = 1.25
"""How much larger than ever before it may be, as a multiple [1]."""
LONGER = 1.5
"""How much longer than ever before it may stand, and be away, as a multiple [1]."""
KEPT = 64
"""How many of a symptom's last times are remembered [1]."""
SAME = 0.1
"""Share of its range by which a command may differ from another that is about the same [1]."""
UNREAD = 10.0
"""For how many ticks its feature may be unknown while a symptom stands [1]."""
STILL = 1e-6
"""The same of one that is not moved [1]."""


@dataclass(slots=True)
class _Time:
    """One time that a symptom came."""

    since_s: float
    until_s: float
    largest: float
    commands: Mapping[str, float]
    moved: bool = False
    """Whether anything was moved or unread meanwhile, so that nobody knows whether it went by itself, or when."""


class Recurring:
    """Remembers when each symptom came and went, and under which commands."""

    def __init__(self, watches: Iterable[SymptomWatch], spans: Mapping[str, float], tick_s: float) -> None:
        """``spans``: tag that is written -> its range, in its unit; what goes while one is moved may not by itself."""
        self._watches, self._spans, self._unread_s = tuple(watches), spans, UNREAD * tick_s
        self._past = {w.rule.name: deque[_Time](maxlen=KEPT) for w in self._watches}
        self._now: dict[str, _Time] = {}
        self._commands: Mapping[str, float] = {}
        self._as_before, self.outgrew = False, False
        """``outgrew``: at this moment what was as before has become larger or stands longer."""
        self.released_s = -math.inf
        """When something was last released [s]."""

    def take(self, snapshot: Snapshot, values: Mapping[str, float | None]) -> None:
        """Take note of which symptoms there are, and of each feature's value; None where it is not known."""
        at_s, commands = snapshot.at_s, {tag: snapshot.values.get(tag, math.nan) for tag in self._spans}
        if not self._same(commands, self._commands, STILL):
            for time in self._now.values():
                time.moved = True
        self._commands = commands
        for watch in self._watches:
            name, value = watch.rule.name, values[watch.rule.feature]
            if watch.active is None:
                gone = self._now.pop(name, None)
                if gone is not None:
                    self._past[name].append(gone)
                continue
            time = self._now.setdefault(name, _Time(watch.active.at_s, at_s, 0.0, commands))
            if value is not None:
                time.moved = time.moved or at_s - time.until_s > self._unread_s
                time.until_s, time.largest = at_s, max(time.largest, watch.excess(value))
        before, self._as_before = self._as_before, self._are_as_before(at_s)
        self.outgrew = before and not self._as_before and bool(self._now)

    def over(self, since_s: float) -> None:
        """What was wrong since ``since_s`` [s] is over, whatever was moved because of it: it went by itself."""
        for time in (*self._now.values(), *(t for times in self._past.values() for t in times)):
            time.moved = time.moved and time.until_s < since_s

    def of(
        self, at_s: float, others: bool, known: Collection[FaultState] = (), led: Iterable[str] = ()
    ) -> Recurrence | None:
        """What has come and gone, and is as it was or has just gone again, at ``at_s`` [s]; None where anything is not.

        ``others``: whether there are symptoms besides, of which nobody knows how often they came. What is ``known`` and
        was there before the first of them, or before something was released, stands: it may grow. So does what other
        symptoms ``led`` to, by their names, if they have gone.
        """
        if others or not self._as_before:
            return None
        past = {name: self._counted(name) for name in self._past if name in self._now or self._swings(name, at_s)}
        if not past or (known and not past.keys() >= set(led)):
            return None
        longest_s = max(t.until_s - t.since_s for times in past.values() for t in times)
        since_s = min(self._past[name][0].since_s for name in past) - LONGER * longest_s
        if any(fault.onset_s < max(since_s, self.released_s) for fault in known):
            return None
        return Recurrence(tuple(past), max(map(len, past.values())), longest_s)

    def _are_as_before(self, at_s: float) -> bool:
        """Whether one symptom comes again and again, there now or not, and every one that is there is as it was."""
        swing = any(self._swings(name, at_s) for name in self._past)
        return swing and all(self._is_as_before(name, at_s) for name in self._now)

    def _is_as_before(self, name: str, at_s: float) -> bool:
        now, past = self._now[name], self._counted(name)
        if now.moved or not past:
            return False
        longest_s = max(t.until_s - t.since_s for t in past)
        return at_s - now.since_s <= LONGER * longest_s and now.largest <= LARGER * max(t.largest for t in past)

    def _swings(self, name: str, at_s: float) -> bool:
        """Whether a symptom comes again and again, and is there or due."""
        past, now = self._counted(name), self._now.get(name)
        came_s = at_s if now is None else now.since_s
        return len(past) >= TIMES and came_s - past[-1].since_s <= LONGER * _apart_s(past)

    def _counted(self, name: str) -> list[_Time]:
        """The times that it went by itself under about the same commands."""
        now = self._now.get(name)
        commands = self._commands if now is None else now.commands
        return [time for time in self._past[name] if not time.moved and self._same(time.commands, commands, SAME)]

    def _same(self, one: Mapping[str, float], other: Mapping[str, float], share: float) -> bool:
        """Whether both are within a ``share`` of the range [1]; a manual output on automatic has no value in either."""
        return one.keys() == other.keys() and all(
            abs(value - other[tag]) <= share * self._spans[tag] or (math.isnan(value) and math.isnan(other[tag]))
            for tag, value in one.items()
        )


def _apart_s(past: list[_Time]) -> float:
    """The longest time from one time to the next [s]."""
    return max(b.since_s - a.since_s for a, b in pairwise(past))
