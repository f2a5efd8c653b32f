"""Clearing: after symptoms that were explained have gone, what explained them may be over, and is looked at again."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.plant.timing import REFERENCE, Timing

LOOKS_S = (8.0, 24.0, 60.0, 150.0)
"""After a symptom has gone, when is looked, by the reference time: readings of some time are needed to tell [s]."""

RETURNS = 0.45
"""How probable it is that what has ended by itself comes back: it swings, sticks, or is loose [1].

Nobody has counted that. It is near as likely as not, and less, so that nothing is the likelier answer.
"""


def may_return(said: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """What may be there all the same once what was ``said`` is over, as likely among itself as it was said."""
    faults = [h for h in said if h.faults and not h.something_else]
    total = sum(h.probability for h in faults)
    if not total:
        return ()
    left = (replace(h, probability=RETURNS * h.probability / total) for h in faults)
    return (Hypothesis((), 1.0 - RETURNS), *left)


class Clearing:
    """Knows which symptoms a diagnosis explained, and says when to look because some of them have gone."""

    def __init__(self, timing: Timing = REFERENCE) -> None:
        """``timing``: that of the plant."""
        self._looks_s = timing.times_s(LOOKS_S)
        self._explained: frozenset[str] = frozenset()
        self._looks: tuple[float, ...] = ()
        self._asked_s = math.inf

    def explained(self, rules: Collection[str]) -> None:
        """A diagnosis explains the symptoms called ``rules``, which are there."""
        self._explained |= frozenset(rules)

    def look_at(self, at_s: float) -> None:
        """Look at ``at_s``, whatever symptoms there are [s]."""
        self._asked_s = at_s

    def over(self) -> None:
        """Nothing is wrong any more: nothing is looked at because of what was explained."""
        self._explained, self._looks = frozenset(), ()

    def due(self, active: Collection[str], at_s: float) -> bool:
        """Whether to look at ``at_s`` [s]; ``active`` are the symptoms that are there."""
        gone = self._explained.difference(active)
        if gone:
            self._explained -= gone
            self._looks = tuple(at_s + after_s for after_s in self._looks_s)
        passed = [look for look in (*self._looks, self._asked_s) if look <= at_s]
        self._looks = tuple(look for look in self._looks if look > at_s)
        self._asked_s = math.inf if self._asked_s <= at_s else self._asked_s
        return bool(passed)
