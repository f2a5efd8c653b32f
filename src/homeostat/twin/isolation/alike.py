"""Alike: explanations whose predictions differ by less than the model is wrong by are not told apart by the readings.

A model that predicts what a reading moves by to a tenth cannot say which of two causes moved it, if both move it
alike to a tenth. The difference d of two predictions is held against that share of the effect e of the better one:
the gap of their log-likelihoods counts by the square of d / (share e), up to all of it. Where both have a fault in
common, e is mostly that fault's: what differs in readings that it hardly moves, as a level that jumps while a valve is
stuck, counts all the same.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from homeostat.domain.diagnosis import FaultMode
from homeostat.twin.isolation.classes import Claim, claim_of, contested
from homeostat.twin.isolation.evidence import TEMPER, Evidence
from homeostat.twin.isolation.search import Scored

TOLD_APART = 2.0
"""Multiples of the model's gain error from which a difference of predictions counts in full [1]."""
MOST = 12
"""Classes that are held against the best one."""


def with_doubt(
    scored: Sequence[Scored], evidence: Evidence, modes: Mapping[str, FaultMode], gain: float
) -> list[Scored]:
    """``scored`` with the gap to the best one made smaller for classes that predict nearly what it predicts.

    ``gain``: share of what a reading has moved by to which the model predicts it [1].
    """
    best: dict[Claim, Scored] = {}
    split = contested(scored, modes)
    for each in scored:
        accused = claim_of(each.faults, modes, split)
        if np.isinf(each.score):  # the model could not carry it
            continue
        if accused not in best or each.score > best[accused].score:
            best[accused] = each
    ranked = sorted(best.items(), key=lambda item: -item[1].score)[:MOST]
    if len(ranked) < 2 or not ranked[0][1].faults:
        return list(scored)
    residuals = evidence.residuals([(), *(each.replayed for _, each in ranked)])
    loss, left = evidence.losses(residuals), evidence.left(residuals)
    moved = left[0] - left[1]
    effect, best_faults = float(np.linalg.norm(moved)), {f.fault for f in ranked[0][1].faults}
    gained: dict[Claim, float] = {}
    for k, (accused, each) in enumerate(ranked[1:], start=2):
        differs = left[k] - left[1]
        apart = float(np.linalg.norm(differs)) / max(TOLD_APART * gain * effect, 1e-12)
        if best_faults & {f.fault for f in each.faults}:
            over = np.maximum(np.abs(differs) - TOLD_APART * gain * np.abs(moved), 0.0)
            apart = max(apart, float(np.linalg.norm(over)) / max(float(np.linalg.norm(differs)), 1e-12))
        gap = 0.5 * float(loss[k] - loss[1]) / TEMPER
        if each.faults and apart < 1.0 and gap > 0.0:
            gained[accused] = (1.0 - apart**2) * gap
    return [replace(s, score=s.score + gained.get(claim_of(s.faults, modes, split), 0.0)) for s in scored]
