"""When a plant that nobody looks after leaves its trip limits, ours and the published one."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.tennessee.published import HOURS, PUBLISHED
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import departing, scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.plants.plant import Plant
from homeostat.plants.truth import NONE
from homeostat.plants.wired.assembly import new_sequencer

FAULTS: Mapping[int, str] = {
    1: "A_poor",
    2: "B_rich",
    3: "D_hot",
    4: "R_water_hot",
    5: "S_water_hot",
    6: "A_lost",
    7: "C_header",
}
"""Number of a published disturbance -> the fault of the plant that it is."""
ONSET_S = 3600.0
"""When it begins [s]."""
_AFTER = 10
"""Readings beyond a limit after which nobody waits any more: from there the model goes where it was not made for."""


@dataclass(frozen=True)
class Trip:
    """How a run without anybody ended."""

    hours: float
    """From the onset to the first trip limit; infinite where all are kept [h]."""
    limit: str = ""
    """What was left first; empty where nothing was."""

    @property
    def told(self) -> str:
        """It as a cell of a table."""
        return f"{self.hours:.2f} h, {self.limit}" if math.isfinite(self.hours) else "kept"


def alone(plant: Plant, fault: str, seed: int, mismatch: str = NONE) -> Trip:
    """What becomes of ``plant`` with ``fault`` at its nominal size, with its own parameters and noise of ``seed``."""
    case = scenario(plant, fault, seed, onset_s=ONSET_S, end_s=ONSET_S + 3600.0 * HOURS)
    case = departing(plant, case, mismatch=mismatch)
    force, beyond = LimitsInForce.after(plant.description, 0.0), 0
    hard = plant.description.limits.hard

    def lost(snapshot: Snapshot) -> bool:
        nonlocal beyond
        read = {name: np.array([[value]]) for name, value in snapshot.values.items()}
        beyond += any(each.formula.evaluate(read, 1.0).value < 0.0 for each in hard)
        return beyond > _AFTER

    truth = watch(open_process(plant, case), new_sequencer(plant).sample, lost).truth()
    trips = [Trip(math.inf)]
    for limit in hard:
        outside = np.flatnonzero(force.outside(limit, truth))
        trips += [Trip((truth.times_s[outside[0]] - ONSET_S) / 3600.0, limit.name)] if outside.size else []
    return min(trips, key=lambda trip: trip.hours)


def published() -> dict[int, tuple[Trip, ...]]:
    """Number of a disturbance -> how runs of the published code ended."""
    found: dict[int, tuple[Trip, ...]] = {}
    with PUBLISHED.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            trip = Trip(float(row["hours"]) if row["hours"] else math.inf, row["why"])
            found[int(row["idv"])] = (*found.get(int(row["idv"]), ()), trip)
    return found
