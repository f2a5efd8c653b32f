"""What the study asks for: parts, seeds, looks, and every run that follows from them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from benchmarks.unknown.causes import (
    HARMLESS,
    HEALTHY,
    KNOWN,
    Cause,
    chosen,
    forced_labels,
    harmless_causes,
    known_faults,
    pairs,
    unknown_causes,
)
from homeostat.evaluate import scenario as scenarios
from homeostat.evaluate.scenario import Fault, Scenario, departing
from homeostat.plants.plant import Plant

UNKNOWN = "unknown"
DAY = "day"
PAIRED = "pairs"
LABELLED = "forced"
PARTS = (UNKNOWN, KNOWN, HARMLESS, HEALTHY, DAY, PAIRED, LABELLED)
LOOKED_AT = (UNKNOWN, KNOWN, HARMLESS, HEALTHY)
"""Parts that are recorded with nobody acting, and judged."""
OPERATED = (UNKNOWN, HARMLESS, DAY, PAIRED, LABELLED)
"""Parts that are run with everything on."""
SEEDS = {
    UNKNOWN: range(601, 604),
    KNOWN: range(601, 621),
    HARMLESS: range(601, 609),
    HEALTHY: range(601, 621),
    PAIRED: range(601, 604),
    LABELLED: range(601, 604),
}
"""Part -> its seeds. Thresholds and explanations were chosen on smaller ones, those from 401 on among them."""
DAY_SEEDS = {"cstr": range(601, 602), "mixing_module": range(601, 745)}
"""Plant -> seeds of the runs that make a fault-free day: one of the reactor, 144 batches of the module."""
DAY_S = {"cstr": 86_400.0}
"""Plant -> length of each of them [s]; as long as any run where it has none."""
BAND_SEEDS = {"cstr": range(9_001, 9_021), "mixing_module": range(9_001, 9_081)}
"""Plant -> seeds of the fault-free runs that say how far features go by themselves."""
LOOKS_S = {"cstr": (0, 60, 240, 600), "mixing_module": (0, 15, 60)}
"""Plant -> when it is looked at, after the first symptom [s]."""
KNOWN_LOOKS_S = {"cstr": (0, 60, 120, 240, 600, 900), "mixing_module": (0, 15, 60, 120, 240)}
"""The same of known faults, whose severities are judged, too."""


@dataclass(frozen=True, slots=True)
class Job:
    """One run of a true plant."""

    plant: str
    """Name of the plant."""
    part: str
    """Part of the study."""
    cause: Cause
    """What is wrong."""
    seed: int
    """Seed of the true plant."""
    mismatch: str
    """How it is not the model that its twin has."""

    @property
    def name(self) -> str:
        """What the study calls the run."""
        return f"{self.plant}-{self.mismatch}-{self.part}-{self.cause.id}-{self.seed}"

    @property
    def truth(self) -> str:
        """A digest of what is true in it: what was found under its name may be about another truth."""
        said = (self.cause.spec, self.cause.faults, self.cause.told, self.looks_s)
        return hashlib.sha256(repr(said).encode()).hexdigest()[:8]

    @property
    def looks_s(self) -> tuple[int, ...]:
        """When it is looked at, after the first symptom [s]."""
        return (KNOWN_LOOKS_S if self.part == KNOWN else LOOKS_S)[self.plant]


def jobs(plant: Plant, parts: Sequence[str], ids: Sequence[str], seeds: Sequence[int], mismatch: str) -> Iterator[Job]:
    """Runs of ``parts``, with the causes of these ``ids`` or classes where any is named, and with their own seeds.

    Seed by seed, so that a study that is stopped has every cause equally often.
    """
    for part in parts:
        for seed in seeds or (DAY_SEEDS[plant.name] if part == DAY else SEEDS[part]):
            for cause in chosen(_causes(plant, part, seed), ids):
                yield Job(plant.name, part, cause, seed, mismatch)


def _causes(plant: Plant, part: str, seed: int) -> tuple[Cause, ...]:
    match part:
        case "unknown":
            return unknown_causes(plant.name)
        case "harmless":
            return harmless_causes(plant.name)
        case "known":
            return known_faults(plant, seed)
        case "pairs":
            return pairs(plant, seed)
        case "forced":
            return forced_labels(plant, seed)
        case _:
            return (Cause("none", HEALTHY),)


def to_operate(wanted: Sequence[Job]) -> list[Job]:
    """Those of ``wanted`` that are run with everything on; of unknown causes only those that are truly unknown."""
    return [job for job in wanted if job.part in OPERATED and not (job.part == UNKNOWN and job.cause.known)]


def scenario_of(plant: Plant, job: Job) -> Scenario:
    """The ground truth of ``job``."""
    faults = [Fault(f.fault, f.severity, f.onset_s) for f in job.cause.faults]
    chosen = scenarios.scenario_of(plant, faults, job.seed, DAY_S.get(plant.name) if job.part == DAY else None)
    return departing(plant, chosen, (job.cause.spec,) if job.cause.spec else (), job.mismatch)
