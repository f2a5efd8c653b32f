"""Standing: actuators that stand where they stood while their commands move.

No size is estimated, and no linear pass finds one: what follows depends on every command since. Each is replayed from
onsets all over the window, and from before it: then it stands where its position was read, or is thought to have been.
As nothing of it can be tuned, one that is right fits as the right explanation does; one that leaves more is none.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from homeostat.domain.diagnosis import FaultMode, FaultState
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.evidence import Evidence
from homeostat.twin.isolation.prior import Prior
from homeostat.twin.isolation.responses import FIRST_ROW
from homeostat.twin.isolation.search import Scored

ONSETS = 24
"""Onsets that are tried all over a window."""
NEWEST = 12
"""Ticks at its end, each of which is tried."""


def standing(evidence: Evidence, modes: Sequence[FaultMode], prior: Prior, beside: FaultSet) -> Iterator[Scored]:
    """The best onset of each of ``modes`` that is an actuator which stands still, ``beside`` others.

    None where there is too little to go by, what is beside is no state of the model, or more is left unexplained than
    of a right explanation: where one of another kind is missing, one that only takes an actuator away is soon the best.
    """
    stuck = [mode for mode in modes if mode.stands]
    window, last = evidence.window, evidence.shape[0] - 1
    if last <= FIRST_ROW:
        return
    every = max((last - FIRST_ROW) // ONSETS, 1)
    rows = sorted({-1, *range(FIRST_ROW, last, every), *range(max(last - NEWEST, FIRST_ROW), last)})
    near = [k for k in range(1 - every, every) if k] if every > 1 else []
    for mode in stuck:
        best = _best(evidence, mode, beside, [window.at_s(row) for row in rows])
        row = window.row(best.faults[-1].onset_s)
        finer = [window.at_s(row + k) for k in near if FIRST_ROW <= row + k < last] if row >= FIRST_ROW else []
        found = max([best, *([_best(evidence, mode, beside, finer)] if finer else [])], key=lambda s: s.score)
        if np.isfinite(found.score) and not evidence.fit_of(found.faults).strained:
            yield Scored(found.faults, found.score + prior.of_mode(mode))


def _best(evidence: Evidence, mode: FaultMode, beside: FaultSet, onsets_s: Sequence[float]) -> Scored:
    sets = [(*beside, FaultState(mode.name, 1.0, onset_s)) for onset_s in onsets_s]
    nats = evidence.likelihoods(sets)  # minus infinity where the model breaks down
    best = int(np.argmax(nats))
    return Scored(sets[best], float(nats[best]))
