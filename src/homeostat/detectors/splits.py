"""Fault-free rows that are learned from, and fault-free rows that are judged then: what false alarms are counted in."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from homeostat.detectors.detector import Values

FOLDS: Final = 5
"""Parts of each run, each of which is judged by what the others teach."""
MOST: Final = 120
"""Most splits: of more, as many are taken at equal distances."""
FEW: Final = 10
"""Pairs of pieces below which they are taken in both directions of time."""
CONTEXT: Final = 60
"""Rows before a judged part from which a detector's memory begins; they are not judged."""


@dataclass(frozen=True, slots=True)
class Split:
    """Fault-free rows in two parts."""

    learned: tuple[Values, ...]
    """Runs to learn from, each of shape (rows, signals)."""
    judged: Values
    """Rows to judge, after ``context`` rows before them, shape (context + rows, signals)."""
    context: int
    """Rows at the begin of ``judged`` that are not judged."""


def folds(runs: Sequence[Values]) -> tuple[Split, ...]:
    """Each run in `FOLDS` parts; all parts of one place are judged by what all the others teach."""
    parts = [np.array_split(run, FOLDS) for run in runs]
    found = []
    for place in range(FOLDS):
        learned = tuple(p for of_run in parts for k, p in enumerate(of_run) if k != place)
        for run, of_run in zip(runs, parts, strict=True):
            first = sum(len(p) for p in of_run[:place])
            context = min(CONTEXT, first)
            found.append(Split(learned, run[first - context : first + len(of_run[place])], context))
    return tuple(found)


def pairs(runs: Sequence[Values], healthy: int | None = None) -> tuple[Split, ...]:
    """Pieces of half of ``healthy`` rows, each judged by what the piece before it teaches; by default half of a run.

    That is how a table is judged whose first ``healthy`` rows are all that is known of its normal level. Where there
    are fewer than `FEW`, each piece is judged by the one after it, too: limits of few rows are worth little.
    """
    length = [(run, (healthy or len(run)) // 2) for run in runs]
    found = [split for run, rows in length for split in onward(run, rows)]
    if len(found) < FEW:
        found += [split for run, rows in length for split in onward(run[::-1], rows)]
    chosen = np.unique(np.linspace(0, len(found) - 1, min(MOST, len(found))).round().astype(int))
    return tuple(found[k] for k in chosen)


def onward(run: Values, length: int) -> Iterator[Split]:
    """Pieces of ``length`` rows of one run, each judged by what the piece before it teaches."""
    context = min(CONTEXT, length)
    for middle in range(length, len(run) - length + 1, length):
        yield Split((run[middle - length : middle],), run[middle - context : middle + length], context)
