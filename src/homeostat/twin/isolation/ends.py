"""Ends: when what was known may have ended within the readings, which are replayed with it until then.

The transient of an end says more than any stretch after it: a transmitter that is put right jumps as no process can,
and a jacket that is cleaned cools at once. Without this, the jump would be another error of the transmitter, and what
cools would be heat that nobody knows beside a fouled jacket, for as long as readings of before are looked at.

    lead = max over t of ln p(readings | known until t) - max ln p(readings | known throughout, at any of some sizes)

Checks: readings that a fault explains to the end have no end with a lead above 0; where it explains them until t and
nothing does from then on, the lead is greatest at t.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from homeostat.process.batch import ProcessError
from homeostat.process.types import Indices, Vec
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.evidence import Evidence, Fit

AFTER, BEFORE = 3, 10
"""Readings after an end, and before it, that must be looked at, besides those that say what state they begin in."""
NEARLY = 2
"""Readings by which an end may be later than the one that explains most."""
LEFT = (0.25, 0.5, 0.75)
"""Shares of its size to which what is known may have shrunk instead [1]."""


@dataclass(frozen=True, slots=True)
class End:
    """That what was known ended within the readings."""

    since_s: float
    """Process time from which no reading shows it any more [s]."""
    lead: float
    """By how much that explains the readings better than what is known does throughout [nats]."""
    over_less: float
    """By how much it explains them better than that less of it is left from then on [nats]."""
    fit: Fit
    """How well it explains the readings."""


def best_end(evidence: Evidence, known: Sequence[FaultSet], throughout: Iterable[FaultSet]) -> End | None:
    """The end of one of ``known`` that explains most; None where the readings are too few, or none can be replayed.

    ``throughout``: what may be there instead from the first reading to the last.
    """
    window = evidence.window
    rows, first = window.length - 1, window.settle_rows + BEFORE
    if rows - AFTER < first:
        return None
    best, nats = None, -np.inf
    for faults in known:
        found = _of_one(evidence, faults, first, rows)
        if found is not None and found[1] > nats:
            best, nats = (faults, found[0]), found[1]
    if best is None:
        return None
    faults, end = best
    whole = float(evidence.likelihoods(list(throughout)).max(initial=-np.inf))
    at = np.array([end])
    less = max(float(evidence.likelihoods_of_ends(faults, at, left)[0]) for left in LEFT)
    fit = evidence.fit(evidence.left(evidence.residuals_of_ends(faults, at))[0])
    return End(window.at_s(min(end + 1 + NEARLY, rows)), nats - whole, nats - less, fit)


def _of_one(evidence: Evidence, faults: FaultSet, first: int, rows: int) -> tuple[int, float] | None:
    """After how many readings the end of ``faults`` explains most, and how likely that makes them [nats]."""
    try:
        ends = np.array(sorted({max(rows - lag, first) for lag in _lags(rows - first)}))
        nats = evidence.likelihoods_of_ends(faults, ends)
        near = _between(ends, nats)
        if len(near):
            ends, nats = np.append(ends, near), np.append(nats, evidence.likelihoods_of_ends(faults, near))
    except ProcessError:  # the readings at the beginning are no state of the model
        return None
    k = int(nats.argmax())
    return (int(ends[k]), float(nats[k])) if np.isfinite(nats[k]) else None


def _lags(most: int) -> Iterator[int]:
    """Readings between an end and the last one that are tried first, up to ``most``: the more, the further apart."""
    lag = AFTER
    while lag <= most:
        yield lag
        lag += max(lag // 8, 1)


def _between(ends: Indices, nats: Vec) -> Indices:
    """Those next to the best of ``ends`` that were not tried."""
    k = int(nats.argmax())
    low, high = ends[max(k - 1, 0)], ends[min(k + 1, len(ends) - 1)]
    return np.setdiff1d(np.arange(low, high + 1), ends)
