"""Every proposer beside the reference, pair by pair: the same plant with the same faults."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from homeostat.evaluate.report.groups import cases, entrant, entrants, in_order, succeeded
from homeostat.evaluate.report.statistics import Estimate, estimate, holm, mcnemar
from homeostat.evaluate.study.row import Row

Pairs = list[tuple[Row, Row]]
"""Rows of one proposer, each with the reference's row of the same pair."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """One proposer against the reference in one case; differences are its values less the reference's."""

    case: str
    """Name of the case."""
    proposer: str
    """Who proposes."""
    name: str
    """Proposer, and what it goes without."""
    reference: str
    """The same of the reference."""
    pairs: int
    """Pairs of runs."""
    both: int
    """Pairs in which both succeeded."""
    only_this: int
    """Pairs in which only this one succeeded."""
    only_reference: int
    """Pairs in which only the reference succeeded."""
    neither: int
    """Pairs in which neither succeeded."""
    p: float
    """Probability of so unequal successes if both are equally good: McNemar's exact test [1]."""
    p_adjusted: float
    """The same, adjusted for the comparisons in this case (Holm) [1]."""
    exposure: Estimate | None
    """Mean difference of the time outside hard limits [s]."""
    loss: Estimate | None
    """Mean difference of the production loss [1]."""
    delay: Estimate | None
    """Mean difference of the delay [s]; pairs in which both batches were completed."""


def comparisons(rows: Sequence[Row], reference: str | None = None) -> list[Comparison]:
    """Every proposer and ablation against ``reference``, by default the first in order that proposes.

    Cases in which the reference has no rows are left out, and so are proposers without a common pair.
    """
    ordered = in_order(rows)
    found = []
    for case in cases(ordered):
        members = [row for row in ordered if row.case == case]
        names = entrants(members)
        first = names[0] if reference is None else reference
        base: dict[tuple[str, str, int], Row] = {}
        for row in members:
            if entrant(row) == first:
                base.setdefault(row.pair, row)
        made = []
        for name in names:
            pairs = [(row, base[row.pair]) for row in members if entrant(row) == name and row.pair in base]
            if name != first and pairs:
                made.append(_compare(case, name, first, pairs))
        adjusted = holm([one.p for one in made])
        found += [replace(one, p_adjusted=p) for one, p in zip(made, adjusted, strict=True)]
    return found


def _compare(case: str, name: str, reference: str, pairs: Pairs) -> Comparison:
    ends = [(succeeded(this), succeeded(other)) for this, other in pairs]
    only_this, only_reference = ends.count((True, False)), ends.count((False, True))
    p = mcnemar(only_this, only_reference)
    return Comparison(
        case=case, proposer=pairs[0][0].proposer, name=name, reference=reference, pairs=len(pairs),
        both=ends.count((True, True)), only_this=only_this, only_reference=only_reference,
        neither=ends.count((False, False)), p=p, p_adjusted=p,
        exposure=_difference(pairs, lambda row: row.exposure_s),
        loss=_difference(pairs, lambda row: row.production_loss),
        delay=_difference(pairs, lambda row: row.delay_s),
    )  # fmt: skip


def _difference(pairs: Pairs, of: Callable[[Row], float | None]) -> Estimate | None:
    """Mean difference over the pairs in which both have the value."""
    values = [(of(this), of(other)) for this, other in pairs]
    return estimate([this - other for this, other in values if this is not None and other is not None])
