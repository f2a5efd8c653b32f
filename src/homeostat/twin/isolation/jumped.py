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

SIGMAS: Final = 4.5 * math.sqrt(2.0)
"""Noise of a difference of two readings that is not taken for a jump [standard deviations of one reading]."""
BESIDE: Final = 10
"""Readings on either side of a jump whose medians say whether it lasts."""


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
    if rule.fastest is None or len(values) < 2:
        return False
    steps = np.diff(values)
    most = rule.fastest * tick_s * np.diff(rows) + SIGMAS * (rule.noise or 0.0)
    for k in np.flatnonzero(np.abs(steps) > most).tolist():
        before, after = values[max(k + 1 - BESIDE, 0) : k + 1], values[k + 1 : k + 1 + BESIDE]
        if (float(np.median(after)) - float(np.median(before))) * math.copysign(1.0, steps[k]) > most[k]:
            return True
    return False
