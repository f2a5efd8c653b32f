"""Which signals have a level of their own: one that has none is watched by its changes from row to row."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from homeostat.detectors.detector import Values
from homeostat.detectors.splits import onward

LEVEL: Final = 1.0
WALK: Final = 5.0
"""Departure of a signal around a level, and of a random walk [1].

Over n steps the variance of a random walk about its own mean is n/6; the next n rows have 5n/6 about that mean.
"""
MOST: Final = WALK**2
"""Most that one run counts for [1]: that a signal was switched in one of them says little of the others."""
WANDERS: Final = (LEVEL + WALK) / 2.0
"""Departure above which a signal has no level [1]."""


def departures(runs: Sequence[Values], healthy: int | None = None) -> Values:
    """How far each signal departs from where it was, shape (signals,) [1], averaged over ``runs``, each counting once.

    That is the mean squared distance from the mean of the piece before, over the variance in that piece; pieces are
    half of ``healthy`` rows long, by default half of a run. Pieces in which a signal stands still say nothing of it; 0
    where it never moves.
    """
    known = np.stack([_departure(run, healthy) for run in runs])
    counted = ~np.isnan(known)
    total: Values = np.where(counted, known, 0.0).sum(axis=0) / np.maximum(counted.sum(axis=0), 1)
    return total


def _departure(run: Values, healthy: int | None) -> Values:
    """The departure of each signal in one run, NaN where it stands still in every piece, shape (signals,)."""
    total, count = np.zeros(run.shape[1]), np.zeros(run.shape[1])
    for split in onward(run, (healthy or len(run)) // 2):
        before, after = split.learned[0], split.judged[split.context :]
        variance, mean = before.var(axis=0), before.mean(axis=0)
        moves = variance > 1e-12 * (1.0 + mean**2)
        distance = ((after - mean) ** 2).mean(axis=0)
        total += np.divide(distance, variance, out=np.zeros_like(variance), where=moves)
        count += moves
    return np.minimum(np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0), MOST)


def levelled(rows: Values, wander: NDArray[np.bool_]) -> Values:
    """``rows`` with the signals that ``wander`` replaced by their changes since the row before; 0 in the first row."""
    changes = np.diff(rows, axis=0, prepend=rows[:1])
    return np.where(wander, changes, rows)
