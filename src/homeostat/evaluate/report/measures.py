"""What a study measures: proposers pair by pair, diagnoses, what was asked, and all of it beside what was possible."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Self

from homeostat.evaluate.report.groups import Group, arm, arms, in_order, overall, plants, succeeded
from homeostat.evaluate.report.statistics import Estimate, Rate, Spread, estimate, holm, mcnemar, rate, spread
from homeostat.record.row import AGENTS, DO_NOTHING, HINDSIGHT, WHOLE, Row


@dataclass(frozen=True, slots=True)
class Comparison:
    """One proposer against the reference in one plant; differences are its values less the reference's."""

    group: Group
    """All runs of the proposer in the plant."""
    reference: str
    """Name of the proposer that it is compared with, and what that goes without."""
    pairs: tuple[tuple[Row, Row], ...]
    """Its runs, each with the reference's of the same pair."""
    p: float
    """Probability of so unequal successes if both are equally good: McNemar's exact test [1]."""
    p_adjusted: float
    """The same, adjusted for the comparisons in this plant (Holm) [1]."""

    def ended(self, this: bool, reference: bool) -> int:
        """Pairs of which this one succeeded or not, and so the reference."""
        return _ended(self.pairs, this, reference)

    def difference(self, of: Callable[[Row], float | None]) -> Estimate | None:
        """Mean difference over the pairs in which both have the value."""
        values = [(of(this), of(other)) for this, other in self.pairs]
        return estimate([this - other for this, other in values if this is not None and other is not None])


def comparisons(rows: Sequence[Row], reference: str | None = None) -> list[Comparison]:
    """Every proposer and ablation against ``reference``, by default the first in order that proposes.

    Plants of which the reference has no rows are left out, and so are proposers without a common pair.
    """
    groups, found = overall(rows), list[Comparison]()
    for plant in plants(rows):
        order = arms([row for row in rows if row.case == plant])
        own = sorted((group for group in groups if group.case == plant), key=lambda group: order.index(group.name))
        first = own[0].name if reference is None else reference
        base = {row.pair: row for group in own for row in reversed(group.rows) if arm(row) == first}
        made = []
        for group in own:
            pairs = tuple((row, base[row.pair]) for row in group.rows if row.pair in base)
            if group.name != first and pairs:
                p = mcnemar(_ended(pairs, True, False), _ended(pairs, False, True))
                made.append(Comparison(group, first, pairs, p, p))
        adjusted = holm([one.p for one in made])
        found += [replace(one, p_adjusted=p) for one, p in zip(made, adjusted, strict=True)]
    return found


def _ended(pairs: Sequence[tuple[Row, Row]], this: bool, reference: bool) -> int:
    return sum((succeeded(one), succeeded(other)) == (this, reference) for one, other in pairs)


BINS: Final = 10
"""Parts of equal width into which probabilities are sorted."""


@dataclass(frozen=True, slots=True)
class Bin:
    """Diagnoses that were held with about the same probability."""

    low: float
    """Least probability [1]."""
    high: float
    """Largest probability [1]; it belongs to the next bin, except 1."""
    believed: float
    """Mean probability of the most probable faults [1]."""
    right: Rate
    """How often that was true."""


def is_right(row: Row) -> bool:
    """Whether the most probable faults are the true ones, in whatever order they are named."""
    return sorted(row.believed.split("+")) == sorted(row.fault.split("+"))


def reliability(rows: Sequence[Row]) -> list[Bin]:
    """Diagnoses by the probability of the most probable faults; bins without any are left out."""
    held: dict[int, list[tuple[float, bool]]] = {}
    for row in rows:
        if row.believed and row.believed_p is not None:
            place = min(int(row.believed_p * BINS), BINS - 1)
            held.setdefault(place, []).append((row.believed_p, is_right(row)))
    bins = []
    for place, members in sorted(held.items()):
        right = rate([true for _, true in members])
        assert right is not None
        mean = sum(sorted(p for p, _ in members)) / len(members)
        bins.append(Bin(place / BINS, (place + 1) / BINS, mean, right))
    return bins


class Usage(NamedTuple):
    """Questions of one run."""

    calls: int
    """Number of questions."""
    read: int
    """Their tokens."""
    written: int
    """Tokens of the answers."""


class Tokens(NamedTuple):
    """What one agent asked per run, over the runs in which any question was asked."""

    agent: str
    """Name of the agent."""
    calls: Spread
    """Questions."""
    read: Spread
    """Their tokens."""
    written: Spread
    """Tokens of the answers."""


def usage(row: Row, agent: str) -> Usage:
    """What ``agent`` asked in a run."""
    match agent:
        case "planning":
            return Usage(row.planning_calls, row.planning_in, row.planning_out)
        case "action":
            return Usage(row.action_calls, row.action_in, row.action_out)
        case _:
            return Usage(row.reprompting_calls, row.reprompting_in, row.reprompting_out)


def asked(row: Row) -> Usage | None:
    """What all agents asked in a run together; None where nobody was asked."""
    calls, read, written = map(sum, zip(*(usage(row, agent) for agent in AGENTS), strict=True))
    return Usage(calls, read, written) if calls else None


def tokens_of(rows: Sequence[Row]) -> list[Tokens]:
    """What each agent asked that asked anything."""
    found = []
    for agent in AGENTS:
        used = [usage(row, agent) for row in rows if asked(row)]
        if any(one.calls for one in used):
            calls, read, written = (spread(values) for values in zip(*used, strict=True))
            assert calls is not None and read is not None and written is not None
            found.append(Tokens(agent, calls, read, written))
    return found


Pair = tuple[str, str, int]
"""What rows have in common that are the same plant with the same faults: plant, scenario, seed."""


@dataclass(frozen=True, slots=True)
class References:
    """Rows of the reference policies, by the pair that they belong to."""

    hindsight: dict[Pair, Row]
    """The best that an exhaustive search on the true plant found."""
    idle: dict[Pair, Row]
    """What happened where nobody acted."""

    @classmethod
    def among(cls, rows: Iterable[Row]) -> Self:
        """The rows that show what was possible; where there are several for a pair, the first in order."""
        whole = [row for row in reversed(in_order(rows)) if row.ablation == WHOLE]
        hindsight, idle = ({r.pair: r for r in whole if r.proposer == who} for who in (HINDSIGHT, DO_NOTHING))
        return cls(hindsight, idle)

    def is_harmless(self, row: Row) -> bool:
        """Whether nothing had to be done: without any action the plant succeeded and never left a hard limit."""
        idle = self.idle.get(row.pair)
        return idle is not None and idle.success and idle.exposure_s <= 0.0

    def possible(self, row: Row) -> Row | None:
        """What hindsight shows of the same plant with the same faults."""
        return self.hindsight.get(row.pair)

    def missed(self, rows: Sequence[Row]) -> Rate | None:
        """Runs that did not succeed, among those in which success was possible by hindsight."""
        return rate([not succeeded(row) for row in rows if (best := self.possible(row)) and succeeded(best)])
