"""Jumped: instruments whose readings moved at once by more than the process can move, by the tables.

No model predicts a reading that is an input of the replay, so that no misfit says of it that it jumped. By the tables
what it measures cannot move so fast. Either they are wrong there, or the instrument is.
"""

import math
from collections.abc import Collection
from typing import Final

import numpy as np

from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.rules import QualityRule
from homeostat.process.types import Flags, Vec
from homeostat.twin.history import Window

BESIDE: Final = 10
"""Readings on either side of a jump whose medians say whether it lasts: a few wild ones, also the last, are none."""


def jumped(window: Window, description: PlantDescription, predicted: Collection[str]) -> frozenset[str]:
    """Instruments of which a reading jumped within ``window``, and stayed there; of what is ``predicted``, none."""
    found = set[str]()
    for signal in description.signals:
        rule = description.qualities.get(signal.tag.name)
        if signal.relation is not Relation.MEASURES or rule is None or signal.variable in predicted:
            continue
        if (readings := window.readings.get(signal.variable)) is not None:
            held = window.held.get(signal.variable, np.zeros(window.length, dtype=bool))
            if _jumps(readings, ~held & np.isfinite(readings), rule, window.tick_s):
                found.add(signal.component)
    return frozenset(found)


def _jumps(readings: Vec, known: Flags, rule: QualityRule, tick_s: float) -> bool:
    """Whether any step between two readings in a row that are ``known`` is too fast, and lasts."""
    rows = np.flatnonzero(known)
    values = readings[rows]
    for k in range(BESIDE, len(values) - BESIDE + 1):
        most, step = rule.most_change(tick_s * float(rows[k] - rows[k - 1])), values[k] - values[k - 1]
        if abs(step) > most:
            lasting = float(np.median(values[k : k + BESIDE]) - np.median(values[k - BESIDE : k]))
            if math.copysign(lasting, lasting * step) > most:
                return True
    return False
