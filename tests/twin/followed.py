"""A twin that has followed a reactor: readings of a plant that nobody touches, for faults of known size and onset."""

from __future__ import annotations

import functools

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import departing, scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.seeds import Stream, noise_seed
from homeostat.twin.twin import Twin

HEALTHY_S = 1400
"""Until here every plant is healthy, and the twin learns its parameters [s]."""
LEARN_S = 600


@functools.cache
def reactor() -> Plant:
    return load_plant("cstr")


@functools.lru_cache(maxsize=64)
def readings(seed: int, end_s: int, faults: tuple[FaultState, ...] = ()) -> tuple[Snapshot, ...]:
    """Every snapshot of an unsupervised run."""
    plant = reactor()
    noise = noise_seed(seed, Stream.TRUTH_NOISE)
    configuration = PlantConfiguration(plant.true_parameters(seed), plant.start, faults, float(end_s), noise)
    link = SimulatedLink(TrueProcess(plant.model, plant.description, configuration))
    return tuple(link.advance() for _ in range(end_s))


def follow(snapshots: tuple[Snapshot, ...], seed: int = 0, learn: bool = True, plant: Plant | None = None) -> Twin:
    """A twin that has seen ``snapshots`` and learned the plant's parameters while it was healthy."""
    plant = plant or reactor()
    twin = Twin(plant.model, plant.description, plant.twin, seed)
    for snapshot in snapshots:
        twin.observe(snapshot)
        if learn and snapshot.at_s == HEALTHY_S:
            twin.calibrate(LEARN_S)
    return twin


@functools.lru_cache(maxsize=64)
def disturbed(seed: int, end_s: int, *disturbances: str, mismatch: str = "none") -> tuple[Snapshot, ...]:
    """Every snapshot of an unsupervised run of a true reactor that is not the twin's."""
    plant = reactor()
    told = departing(plant, scenario(plant, "none", seed, end_s=float(end_s)), disturbances, mismatch)
    link = SimulatedLink(open_process(plant, told))
    return tuple(link.advance() for _ in range(end_s))
