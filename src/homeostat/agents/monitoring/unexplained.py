"""Unexplained: which symptoms nothing explains, when they are looked at again, and how large they were then."""

from collections.abc import Iterable, Mapping, Sequence

from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultState, Hypothesis, Symptom

GREW = 2.0
"""What is this many times as large as it ever was at a look is looked at again at once [1]."""


class Unexplained:
    """One situation at a time: the symptoms that stand, or stood until lately, without anything that explains them.

    The wait between two looks doubles while nothing new is seen. A symptom that was not among them begins it anew; one
    that comes and goes does not, because it is forgotten only once it has been gone for as long as would be waited.
    """

    def __init__(self, first_s: float, longest_s: float) -> None:
        """``first_s`` and ``longest_s``: between what a wait lies [s]."""
        self._first_s, self._longest_s = min(first_s, longest_s), longest_s
        self._wait_s = self._first_s
        self._seen_s: dict[str, float] = {}
        self._largest: dict[str, float] = {}
        self._sizes: Mapping[str, float] = {}

    def take(self, sizes: Mapping[str, float], at_s: float) -> None:
        """The symptoms that there are at ``at_s`` [s]: name -> how many times its threshold it is now [1]."""
        self._sizes = sizes
        self._seen_s.update({rule: at_s for rule in sizes if rule in self._seen_s})
        self._forget([rule for rule, seen_s in self._seen_s.items() if at_s - seen_s >= self._wait_s])

    def left(self, rules: Iterable[str], at_s: float) -> float:
        """A look at ``at_s`` has left the symptoms called ``rules`` unexplained: how long until the next one [s]."""
        every = list(rules)
        if any(rule not in self._seen_s for rule in every):
            self._wait_s = self._first_s
        for rule in every:
            self._seen_s[rule] = at_s
            self._largest[rule] = max(self._largest.get(rule, 0.0), self._sizes.get(rule, 0.0))
        wait_s = self._wait_s
        self._wait_s = min(2.0 * wait_s, self._longest_s)
        return wait_s

    def explained(self, rules: Iterable[str]) -> None:
        """The symptoms called ``rules`` are explained."""
        self._forget(rules)

    def grew(self, rule: str) -> bool:
        """Whether a symptom that nothing explains is far larger than it was at any look."""
        least = self._largest.get(rule)
        return least is not None and self._sizes.get(rule, 0.0) >= GREW * max(least, 1.0)

    def _forget(self, rules: Iterable[str]) -> None:
        for rule in rules:
            self._seen_s.pop(rule, None)
            self._largest.pop(rule, None)
        if not self._seen_s:
            self._wait_s = self._first_s


def nothing_fits(symptoms: Sequence[Symptom], at_s: float) -> tuple[Hypothesis, ...]:
    """The explanation of ``symptoms`` at ``at_s`` [s] where none that anybody can name was even tried."""
    since_s = min((s.at_s for s in symptoms), default=at_s)
    return (Hypothesis((FaultState(SOMETHING_ELSE, 1.0, since_s),), 1.0),)
