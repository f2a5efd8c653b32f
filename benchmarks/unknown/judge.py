"""The words that a look is judged by, and what a statement is worth: nothing here knows how it was found."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from typing import Any

from benchmarks.unknown.causes import Cause
from homeostat.domain.diagnosis import AS_LIKELY_AS_NOT, SOMETHING_ELSE

SURE = 0.9
"""Probability from which a statement counts as made [1]."""
NATS = 3.0
"""What lies no further below the best statement than this belongs to the answer [nats]."""
NONE = "none"
"""Name of the statement that nothing is wrong."""
UNKNOWN = "unknown"
"""What the name of a statement begins with that names no fault."""


@dataclass(frozen=True, slots=True)
class Statement:
    """One thing that is said at a look."""

    name: str
    """Name of the fault, 'unknown ...', or 'none'; several at once are joined by '+'."""
    component: str
    """Component of the equipment table that it is about, one for each name, joined by '+'; empty for none."""
    balance: str
    """Balance that it is about, as 'heat R1'; empty for none."""
    probability: float
    """How sure it is [1]."""
    severity: float | None = None
    """Severity in the fault's unit; None where it has none."""
    interval: tuple[float, float] | None = None
    """Between what it is said to lie, in the same unit; None where no two sizes are stated."""

    @property
    def items(self) -> frozenset[str]:
        """Components that it is about."""
        return frozenset(filter(None, self.component.split("+")))

    @property
    def fault_names(self) -> tuple[str, ...]:
        """Names of faults in it; those that say unknown or none are no names."""
        return tuple(n for n in self.name.split("+") if n != NONE and not n.startswith(UNKNOWN))

    def names_another(self, item: str) -> bool:
        """Whether what is false in it is a fault's name; where every component is ``item``, the balance is false."""
        pairs = list(zip(self.name.split("+"), self.component.split("+"), strict=True))
        false = [(name, about) for name, about in pairs if about != item] or pairs
        return any(not name.startswith(UNKNOWN) for name, _ in false)


class Verdict(StrEnum):
    """What the answer of one look is, in the words of the study."""

    RIGHT = "right"
    """The item, or an unknown on its balance, is the best statement; or that nothing is wrong where that is so."""
    SET = "set"
    """Nothing else is said for sure, and what lies within 3 nats of the best holds the item."""
    WRONG = "wrong"
    """Another item is named at 0.9 or more."""
    ELSEWHERE = "unknown elsewhere"
    """An unknown on another item or balance is said at 0.9 or more."""
    NOTHING = "nothing"
    """Nothing is said, or that nothing is wrong."""
    UNSURE = "unsure"
    """Nothing is said for sure, and what lies within 3 nats of the best does not hold the item."""


GOOD = (Verdict.RIGHT, Verdict.SET)
BAD = (Verdict.WRONG, Verdict.ELSEWHERE)


def is_right(statement: Statement, cause: Cause) -> bool:
    """Whether ``statement`` is true: it is about the item alone, or an unknown on a balance that it is in.

    An item may be in several balances, as a vessel is in that of its heat and in that of its mass: the other one is
    another cause.
    """
    if statement.name == NONE:
        return cause.measured or not cause.item
    if statement.balance and cause.balances and statement.balance not in cause.balances:
        return False
    if statement.name.startswith(UNKNOWN) and statement.balance:
        return statement.balance in cause.balances
    return statement.items == {cause.item}


def holds(statement: Statement, cause: Cause) -> bool:
    """Whether ``statement`` is true, or says the item beside others."""
    return is_right(statement, cause) or (len(statement.items) > 1 and cause.item in statement.items)


def is_alike(statement: Statement, cause: Cause) -> bool:
    """Whether it is about what the instruments cannot tell from the truth."""
    about = {*statement.items, statement.balance} - {"", cause.item, *cause.balances}
    return bool(about) and about <= set(cause.alike)


def verdict(said: Sequence[Statement], cause: Cause, at_s: float = -math.inf) -> Verdict:
    """What the answer ``said`` is worth where ``cause`` is true; ``at_s``: when it was said [s].

    Where the cause has ended by then, that nothing is wrong any more is right, too.
    """
    if cause.ended(at_s) and (not said or max(listed(said), key=lambda s: s.probability).name == NONE):
        return Verdict.RIGHT
    if not said:
        return Verdict.RIGHT if cause.measured or not cause.item else Verdict.NOTHING
    said = listed(said)
    best = max(said, key=lambda s: s.probability)
    if false := sure_of_another(said, cause):
        return Verdict.WRONG if false.names_another(cause.item) else Verdict.ELSEWHERE
    if is_right(best, cause):
        return Verdict.RIGHT
    if any(holds(s, cause) for s in answer(said)):
        return Verdict.SET
    return Verdict.NOTHING if best.name == NONE else Verdict.UNSURE


def listed(said: Sequence[Statement]) -> tuple[Statement, ...]:
    """What is said about items, with the probabilities among themselves; what is sure is so among these.

    A share for something else, which is no statement about an item, must make no wrong name unsure. Where something
    else is as likely as not, everything stays as it is said.
    """
    other = sum(s.probability for s in said if s.name == SOMETHING_ELSE)
    if not 0.0 < other < AS_LIKELY_AS_NOT:
        return tuple(said)
    kept = [s for s in said if s.name != SOMETHING_ELSE]
    total = sum(s.probability for s in kept)
    return tuple(replace(s, probability=s.probability / total) for s in kept)


def answer(said: Sequence[Statement]) -> tuple[Statement, ...]:
    """The set that is the answer: statements about items within :data:`NATS` of the best."""
    said = [s for s in said if s.name != SOMETHING_ELSE] or said
    least = max((s.probability for s in said), default=1.0) * math.exp(-NATS)
    return tuple(s for s in said if s.probability >= least)


def sure_of_another(said: Sequence[Statement], cause: Cause) -> Statement | None:
    """A statement about another item or balance that is as sure as :data:`SURE`; None where there is none.

    Statements about one item add up: two faults of a pump are the same wrong item.
    """
    sums: dict[str, float] = {}
    said = listed(said)
    for one in said:
        if one.name != NONE and not is_right(one, cause):
            for about in (one.items - {cause.item} or {one.balance}) - {""}:
                sums[about] = sums.get(about, 0.0) + one.probability
    wrong = [about for about, probability in sums.items() if probability >= SURE - 1e-9]
    found = [s for s in said if not is_right(s, cause) and (s.items & set(wrong) or s.balance in wrong)]
    return max(found, key=lambda s: s.probability) if wrong else None


def named(said: Sequence[Statement], least: float = 0.5) -> tuple[str, ...]:
    """Statements with the name of a fault in them that are made at ``least`` or more."""
    return tuple(s.name for s in listed(said) if s.fault_names and s.probability >= least)


@dataclass(frozen=True, slots=True)
class Bin:
    """Statements of about the same probability."""

    low: float
    """Least probability [1]."""
    high: float
    """Probability that it ends before [1]."""
    count: int
    """How many statements there are."""
    said: float
    """Their mean probability [1]; NaN for none."""
    right: float
    """Share of them that is right [1]; NaN for none."""


EDGES = (0.0, 0.1, 0.3, 0.5, 0.7, 0.85, 1.0)
"""Where bins begin and end that hold enough: nothing is said with more than 0.94, see `misled` of the plants."""
LEAST_COUNT = 150
"""Statements that a bin needs; one with fewer is merged with the neighbour that has fewer."""


def reliability(statements: Iterable[tuple[float, bool]], edges: Sequence[float] = EDGES) -> tuple[Bin, ...]:
    """How often statements are right, by their probability; 1 belongs to the last bin."""
    every = list(statements)
    found = []
    for low, high in pairwise(edges):
        mine = [(p, right) for p, right in every if low <= p < high or p == high == edges[-1]]
        count = len(mine)
        said = sum(p for p, _ in mine) / count if count else math.nan
        found.append(Bin(low, high, count, said, sum(r for _, r in mine) / count if count else math.nan))
    return tuple(found)


def merged(statements: Iterable[tuple[float, bool]], edges: Sequence[float] = EDGES) -> tuple[Bin, ...]:
    """As :func:`reliability`, with bins merged until each holds :data:`LEAST_COUNT` statements, the smallest first.

    A bin goes to the neighbour that holds fewer, the lower one of two that hold as many. It is one bin at least.
    """
    every, kept = list(statements), list(edges)
    while True:
        bins = reliability(every, kept)
        counts = [b.count for b in bins]
        k = counts.index(min(counts))
        if counts[k] >= LEAST_COUNT or len(bins) == 1:
            return bins
        below, above = (counts[j] if 0 <= j < len(counts) else math.inf for j in (k - 1, k + 1))
        del kept[k if below <= above else k + 1]


def statement(row: Mapping[str, Any]) -> Statement:
    """The statement that a line of results holds."""
    interval = row.get("interval")
    return Statement(**{**row, "interval": None if interval is None else tuple(interval)})
