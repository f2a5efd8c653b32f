"""How well what was believed agrees with what was true: detection, diagnosis, and what a probability is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from homeostat.evaluate.report.statistics import Estimate, Rate, Spread, estimate, rate, spread
from homeostat.evaluate.study.row import Row

BINS: Final = 10
"""Parts of equal width into which probabilities are sorted."""
_NO_FAULT: Final = "none"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Detection and diagnosis of one group."""

    detected: Rate | None
    """Runs with a fault in which something was reported after its onset."""
    delay: Spread | None
    """From the first onset to the first report [s]; of those that were detected."""
    false_alarms: Rate
    """Runs in which something was reported before any onset."""
    right: Rate | None
    """Diagnoses whose most probable faults were the true ones."""
    truth: Estimate | None
    """Mean probability that was given to the truth [1]."""
    brier: Estimate | None
    """Mean Brier score, 0 (certain and right) to 2 (certain and wrong) [1]."""


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


def diagnosis_of(rows: Sequence[Row]) -> Diagnosis:
    """Detection and diagnosis of one group; ``rows`` must not be empty."""
    false_alarms = rate([row.false_alarm for row in rows])
    assert false_alarms is not None
    return Diagnosis(
        detected=rate([row.detection_s is not None for row in rows if row.fault != _NO_FAULT]),
        delay=spread([row.detection_s for row in rows if row.detection_s is not None]),
        false_alarms=false_alarms,
        right=rate([is_right(row) for row in rows if row.believed]),
        truth=estimate([row.true_p for row in rows if row.true_p is not None]),
        brier=estimate([row.brier for row in rows if row.brier is not None]),
    )


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
