"""How well what was believed agrees with what was true, and what a probability is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from homeostat.evaluate.report.statistics import Rate, rate
from homeostat.evaluate.study.row import Row

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
    """Mean probability of what was believed [1]."""
    right: Rate
    """How often that was true."""


def is_right(row: Row) -> bool:
    """Whether the faults that were believed are the true ones, in whatever order they are named."""
    return sorted(row.believed.split("+")) == sorted(row.fault.split("+"))


def reliability(rows: Sequence[Row]) -> list[Bin]:
    """Diagnoses by the probability of what was believed; bins without any are left out."""
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
