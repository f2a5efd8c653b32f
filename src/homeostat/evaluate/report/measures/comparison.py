"""Every proposer beside the reference, pair by pair: the same plant with the same faults."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from homeostat.evaluate.report.groups import Group, arm, arms, cases, overall, succeeded
from homeostat.evaluate.report.statistics import Estimate, estimate, holm, mcnemar
from homeostat.evaluate.study.row import Row


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

    Cases in which the reference has no rows are left out, and so are proposers without a common pair.
    """
    groups, found = overall(rows), list[Comparison]()
    for plant in cases(rows):
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
