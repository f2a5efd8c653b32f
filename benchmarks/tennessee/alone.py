"""When a plant that nobody looks after leaves its trip limits, ours and the published one."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.tennessee.published import HOURS, PUBLISHED
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario, departing, scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.plants.plant import Plant
from homeostat.plants.truth import NONE
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.batch import ProcessError

DISTURBANCES = Path(__file__).with_name("disturbances.csv")
"""Each published disturbance in our words: a fault of the plant's tables, or what happens to the true plant."""
ONSET_S = 3600.0
"""When it begins [s]."""
_AFTER = 10
"""Readings beyond a limit after which nobody waits any more: from there the model goes where it was not made for."""


@dataclass(frozen=True)
class Upset:
    """A published disturbance in our words."""

    idv: int
    """Its published number."""
    fault: str
    """Fault of the plant's tables that it is; empty where it stands in none."""
    disturbances: tuple[str, ...]
    """What it does to the true plant instead, from the start on; empty for a fault."""
    published: str
    """What it is called there."""
    source: str
    """Where what it does is published."""

    @property
    def told(self) -> str:
        """It as a cell of a table."""
        return self.fault or "; ".join(self.disturbances)

    def scenario(self, plant: Plant, seed: int, onset_s: float, end_s: float, mismatch: str = NONE) -> Scenario:
        """It at its nominal size from ``onset_s`` on, in a run that ends at ``end_s`` [s]."""
        onset = onset_s if self.fault else None
        case = scenario(plant, self.fault or "none", seed, onset_s=onset, end_s=end_s)
        return departing(plant, case, [f"{text} from {onset_s:g}" for text in self.disturbances], mismatch)


def upsets() -> dict[int, Upset]:
    """Number of every published disturbance, 1 to 28 -> what it is here."""
    with DISTURBANCES.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    found = {}
    for row in rows:
        texts = tuple(text.strip() for text in row["disturbances"].split(";") if text.strip())
        found[int(row["idv"])] = Upset(int(row["idv"]), row["fault"], texts, row["published"], row["source"])
    return found


def stuck(plant: Plant) -> dict[str, Upset]:
    """Name -> each valve of ``plant`` stuck closed, stuck open, and where it stands when it sticks."""
    known = {fault.name for fault in plant.description.faults}
    found = {}
    for valve in dict.fromkeys(fault.component for fault in plant.description.faults):
        ends = {f"{valve} {end}": f"{valve}_stuck_{end}" for end in ("closed", "open")}
        if not known.issuperset(ends.values()):
            continue
        found |= {name: Upset(0, fault, (), "", "") for name, fault in ends.items()}
        found[f"{valve} as it stands"] = Upset(0, "", (f"{valve} stiction 1",), "", "")
    return found


HEALTHY = Upset(0, "", (), "", "")
"""No disturbance at all."""
HIDDEN = (16, 17, 18, 20)
"""Numbers of the published disturbances that stand in no table, neither there nor here."""


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


@dataclass(frozen=True)
class Ended:
    """A run without anybody."""

    trip: Trip
    truth: Trajectory
    """What was the case, up to a little after the trip."""


def ended(plant: Plant, upset: Upset, seed: int, mismatch: str = NONE) -> tuple[Trip, Trajectory]:
    """What becomes of ``plant`` with ``upset``, with parameters, courses and noise of ``seed``; true values."""
    found = left_alone(plant, upset.scenario(plant, seed, ONSET_S, ONSET_S + 3600.0 * HOURS, mismatch))
    return found.trip, found.truth


def left_alone(plant: Plant, case: Scenario) -> Ended:
    """What becomes of ``plant`` in ``case``; hours are counted from its onset, or from its beginning where none is."""
    onset_s = case.onset_s or 0.0
    force, beyond = LimitsInForce.after(plant.description, 0.0), 0
    hard = plant.description.limits.hard

    def lost(snapshot: Snapshot) -> bool:
        nonlocal beyond
        read = {name: np.array([[value]]) for name, value in snapshot.values.items()}
        beyond += any(each.formula.evaluate(read, 1.0).value < 0.0 for each in hard)
        return beyond > _AFTER

    process, trips = open_process(plant, case), [Trip(math.inf)]
    try:
        watch(process, new_sequencer(plant).sample, lost)
    except ProcessError:  # beyond its limits the model goes where there is no plant
        trips += [Trip((process.truth().times_s[-1] - onset_s) / 3600.0, "no plant any more")]
    truth = process.truth()
    for limit in hard:
        outside = np.flatnonzero(force.outside(limit, truth))
        trips += [Trip((truth.times_s[outside[0]] - onset_s) / 3600.0, limit.name)] if outside.size else []
    return Ended(min(trips, key=lambda trip: trip.hours), truth)


def published() -> dict[int, tuple[Trip, ...]]:
    """Number of a disturbance -> how runs of the published code ended."""
    found: dict[int, tuple[Trip, ...]] = {}
    with PUBLISHED.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            trip = Trip(float(row["hours"]) if row["hours"] else math.inf, row["why"])
            found[int(row["idv"])] = (*found.get(int(row["idv"]), ()), trip)
    return found
