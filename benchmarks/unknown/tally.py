"""What judged looks come to: shares, intervals, severities; nothing here reads a file."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from benchmarks.unknown.causes import Cause
from benchmarks.unknown.jobs import Job
from benchmarks.unknown.judge import (
    BAD,
    GOOD,
    NONE,
    Statement,
    Verdict,
    answer,
    holds,
    is_alike,
    is_right,
    listed,
    named,
    sure_of_another,
    verdict,
)
from benchmarks.unknown.judging import NO_LOOK, Judged
from homeostat.domain.diagnosis import AS_LIKELY_AS_NOT, SOMETHING_ELSE, FaultMode

SEVERITY_AFTER_S = 120
"""Time after the first symptom at which severities are judged [s]."""
SLOW_AFTER_S = 900
"""The same of faults that take long to show their size [s]."""
SLOW = ("fouling",)
NOTHING = Statement(NONE, "", "", 0.0)


@dataclass(frozen=True, slots=True)
class Look:
    """One look at one run, or the run without a symptom."""

    job: Job
    """The run."""
    judged: Judged
    """What was said."""

    @property
    def looked(self) -> bool:
        """Whether there was a symptom, and the run lived to see the look."""
        return self.judged.after_s != NO_LOOK and math.isfinite(self.judged.at_s)

    @property
    def best(self) -> Statement | None:
        """The most probable statement about an item, or that nothing is wrong; None where nothing was said."""
        return max(listed(self.judged.said), key=lambda s: s.probability, default=None)

    @property
    def verdict(self) -> Verdict:
        """What the answer is worth."""
        return verdict(self.judged.said, self.job.cause, self.judged.at_s)

    @property
    def named(self) -> bool:
        """Whether the best statement is a fault of the item, by its name."""
        best = self.best or NOTHING
        return bool(best.fault_names) and is_right(best, self.job.cause)

    @property
    def borrowed(self) -> bool:
        """Whether what is right is so by the name of a fault that is not there: the item, but not its law."""
        return self.verdict is Verdict.RIGHT and self.named and not self.job.cause.known

    @property
    def bad(self) -> bool:
        """Whether another item or balance is said for sure."""
        return self.verdict in BAD

    @property
    def refused(self) -> bool:
        """Whether the best explanation does not fit: something else is as likely as not."""
        return any(s.name == SOMETHING_ELSE and s.probability >= AS_LIKELY_AS_NOT for s in self.judged.said)

    @property
    def alike(self) -> bool:
        """Whether what is said wrongly cannot be told from the truth by these instruments."""
        other = sure_of_another(self.judged.said, self.job.cause)
        return self.bad and other is not None and is_alike(other, self.job.cause)

    @property
    def good(self) -> bool:
        """Whether the answer is right or holds what is."""
        return self.verdict in GOOD


@dataclass(frozen=True, slots=True)
class Share:
    """How many of how many."""

    of: int
    """Of how many."""
    many: int
    """How many."""

    @classmethod
    def that(cls, looks: Iterable[Look], holds: Callable[[Look], bool]) -> Share:
        """How many of ``looks`` something holds of."""
        every = [holds(look) for look in looks]
        return cls(len(every), sum(every))

    @property
    def value(self) -> float:
        """The share [1]; NaN of nothing."""
        return self.many / self.of if self.of else math.nan

    def __str__(self) -> str:
        """As a page has it."""
        return f"{self.many} of {self.of} ({100 * self.value:.0f} %)" if self.of else "none"


def of_runs(looks: Sequence[Look], jobs: Iterable[Job]) -> tuple[int, int]:
    """How many of the runs of ``jobs`` are in, and how many there are."""
    there = {look.judged.run for look in looks}
    names = {job.name for job in jobs}
    return len(names & there), len(names)


def right_from(looks: Sequence[Look], after_s: float) -> Share:
    """Of noticeable causes, how often the answer is right at ``after_s`` or later.

    A noticeable cause without a symptom counts once, as one of which nothing was said.
    """
    mine = [x for x in looks if x.judged.noticeable]
    judged = [x for x in mine if (x.looked and x.judged.after_s >= after_s) or x.judged.after_s == NO_LOOK]
    return Share.that(judged, lambda x: x.looked and x.good)


def counts(looks: Iterable[Look]) -> Counter[Verdict]:
    """How often each verdict came."""
    return Counter(x.verdict for x in looks)


def statements(looks: Iterable[Look]) -> list[tuple[float, bool]]:
    """Probability of everything that was said, that nothing is wrong included, and whether it is right.

    What may be right together is one statement: an unknown on a balance, and the names of what is in that balance.
    That something else is wrong is right where nothing else that was said is.
    """
    found = []
    for x in looks:
        groups: dict[str, list[Statement]] = {}
        said = [s for s in x.judged.said if s.probability > 0.0] if x.looked else []
        unknown = {s.balance for s in said if not s.fault_names} - {""}
        for s in said:
            groups.setdefault(s.balance if s.balance in unknown else s.name, []).append(s)
        right = {key: any(truly(s, x.job.cause, x.judged.at_s) for s in group) for key, group in groups.items()}
        if SOMETHING_ELSE in groups:
            right[SOMETHING_ELSE] = not any(right.values())
        found += [(sum(s.probability for s in group), right[key]) for key, group in groups.items()]
    return found


def answers(looks: Iterable[Look]) -> list[tuple[float, bool]]:
    """Summed probability of each answer, which may be a set, and whether it holds what is true."""
    found = []
    for x in looks:
        if x.looked and x.judged.said:
            said = answer(x.judged.said)
            right = any(truly(s, x.job.cause, x.judged.at_s) or holds(s, x.job.cause) for s in said)
            found.append((min(sum(s.probability for s in said), 1.0), right))
    return found


def truly(statement: Statement, cause: Cause, at_s: float = -math.inf) -> bool:
    """Whether ``statement`` is true at ``at_s`` [s].

    That nothing is wrong is true of what leaves every criterion satisfied, and of what has ended by then.
    """
    if statement.name == NONE and not cause.measured:
        return not cause.item or cause.ended(at_s)
    return is_right(statement, cause)


def severity_errors(looks: Iterable[Look], fault: FaultMode) -> list[float]:
    """Distances of stated severities of ``fault`` from the true ones, as shares of the range, when they are judged."""
    after_s = SLOW_AFTER_S if fault.name in SLOW else SEVERITY_AFTER_S
    found = []
    for x in looks:
        if x.job.cause.fault != fault.name or x.judged.after_s != after_s or not x.looked or not x.judged.said:
            continue
        best = x.best or NOTHING
        if best.name == fault.name and best.severity is not None:
            found.append(abs(best.severity - x.job.cause.severity) / fault.severity_range.span)
    return found


def with_a_name(looks: Iterable[Look], least: float = 0.5) -> tuple[str, ...]:
    """Runs in which a fault is named at ``least`` or more, each with its names.

    A run of what is called harmless that violates something is none.
    """
    found: dict[str, dict[str, None]] = {}
    for x in looks:
        if not x.judged.violated and (names := named(x.judged.said, least)):
            found.setdefault(x.judged.run, {}).update(dict.fromkeys(names))
    return tuple(f"{run}: {', '.join(names)}" for run, names in found.items())
