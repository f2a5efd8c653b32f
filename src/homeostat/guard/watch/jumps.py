"""Jumps: by how much a reading has moved within a second or two that no process can move by.

Such a reading was wrong before, or is wrong since: what it was before, carried on by what it has moved by otherwise,
is as possible as what it is. Nothing that the guard knows tells the two apart, so a limit is watched on both, until
the reading jumps back, or a person has looked at the plant. Where a diagnosis said before that the reading was wrong,
a jump against that error ends it, and is none by as much.
"""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from homeostat.domain.plant.rules import QualityRule

UNSURE = 2.0 * math.sqrt(2.0)
"""By how much more a reading may have jumped than the two readings say [standard deviations of one reading]."""

RECENT = 10
"""Readings that say how far an instrument scatters."""


def steps(rule: QualityRule, difference: float, after_s: float, scatter: float = 0.0) -> bool:
    """Whether a reading that changed by ``difference`` within ``after_s`` [s] did so faster than the process can.

    ``scatter``: by how much it has differed from itself besides, in the unit of its tag.
    """
    return abs(difference) > rule.most_change(after_s) + scatter


@dataclass(slots=True)
class _Followed:
    """What is remembered of one tag."""

    value: float = math.nan
    changed_s: float = -math.inf
    """When it became this [s]: what a frozen reading has missed is no jump."""
    by: float = 0.0
    before: float = math.nan
    """Value before the jumps that may still turn out to be wild readings."""
    before_by: float = 0.0
    open_until_s: float = -math.inf
    error: float = 0.0
    """What a diagnosis says that it reads too high, under every explanation."""
    recent: deque[float] = field(default_factory=lambda: deque(maxlen=RECENT))
    """Readings since the last jump."""

    @property
    def scatter(self) -> float:
        """How far they are apart: an instrument that has become noisy does not jump."""
        return max(self.recent) - min(self.recent) if self.recent else 0.0

    def close(self) -> None:
        """The last jump lasts: what was read before it says nothing of how far it scatters now."""
        if self.open_until_s > -math.inf:
            self.open_until_s = -math.inf
            self.recent.clear()


class Jumps:
    """Adds up what each reading has jumped by, in the unit of its tag."""

    def __init__(self, rules: Mapping[str, QualityRule]) -> None:
        """``rules``: tag -> how fast its reading can move; one that has no such rate never jumps."""
        self._rules = {tag: rule for tag, rule in rules.items() if rule.fastest is not None}
        self._followed = {tag: _Followed() for tag in self._rules}

    @property
    def errors(self) -> Mapping[str, float]:
        """Tag -> its reading minus what it may be at worst without its jumps, of those that have jumped."""
        return {tag: self._at_worst(tag, seen.by) for tag, seen in self._followed.items() if seen.by}

    def by(self, tag: str) -> float:
        """What the reading of ``tag`` has jumped by."""
        return self._followed[tag].by

    def _at_worst(self, tag: str, by: float) -> float:
        return math.copysign(abs(by) + UNSURE * (self._rules[tag].noise or 0.0), by)

    def take(self, tag: str, value: float, taken_s: float) -> bool:
        """Take a new reading of ``taken_s`` [s]; whether it has jumped, or jumped back."""
        if tag not in self._rules:
            return False
        rule, seen = self._rules[tag], self._followed[tag]
        had, after_s, difference = seen.by, taken_s - seen.changed_s, value - seen.value
        awaited = taken_s <= seen.open_until_s
        if not awaited:
            seen.close()
        if awaited and not steps(rule, value - seen.before, after_s, seen.scatter):
            seen.by, seen.open_until_s = seen.before_by, -math.inf  # wild values: it goes on from where it was
            seen.recent.append(value)
        elif steps(rule, difference, after_s, seen.scatter):  # never of the first reading
            if not awaited:
                seen.before, seen.before_by = seen.value, seen.by
            seen.open_until_s = taken_s + rule.grace_s
            seen.by = self._jumped(rule, seen, difference, after_s)
        elif not awaited:
            seen.recent.append(value)
        if difference != 0.0:
            seen.value, seen.changed_s = value, taken_s
        return seen.by != had

    def _jumped(self, rule: QualityRule, seen: _Followed, difference: float, after_s: float) -> float:
        """What it has jumped by in all, now that it has by ``difference``; back is 0."""
        by = seen.by + difference
        if by * seen.error < 0.0:  # the error ends that was known
            by += math.copysign(min(abs(seen.error), abs(by)), seen.error)
        return by if steps(rule, by, after_s, seen.scatter) else 0.0

    def correct(self, errors: Sequence[Mapping[str, float]]) -> None:
        """Take note of a diagnosis: tag -> reading minus truth under each explanation; of what all say, the least."""
        for tag, seen in self._followed.items():
            said = [error.get(tag, 0.0) for error in errors]
            alike = bool(said) and (all(e > 0.0 for e in said) or all(e < 0.0 for e in said))
            seen.error = min(said, key=abs) if alike else 0.0

    def remember(self, errors: Mapping[str, float]) -> None:
        """Go on after a death: what had jumped still has."""
        for tag, by in errors.items():
            if tag in self._followed and math.isfinite(by):
                self._followed[tag].by = self._followed[tag].before_by = by

    def forget(self) -> None:
        """Readings count as they are: somebody has looked, or the process moves as it never does in operation."""
        for seen in self._followed.values():
            seen.by, seen.before_by, seen.open_until_s = 0.0, 0.0, -math.inf
