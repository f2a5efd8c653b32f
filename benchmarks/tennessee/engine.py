"""How fast members of the plant are simulated, and how long it takes until the first one is."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.ready import ready_s
from homeostat.plants.plant import Plant
from homeostat.process.batch import Batch, simulate

MEMBERS = 1000


@dataclass(frozen=True)
class Speed:
    """Wall-clock times [s]."""

    crowd_s: float
    """Of an hour of :data:`MEMBERS` members with noise, on all cores."""
    cold_s: float
    """Of a process that has no machine code, until it has a plant and its kernel."""
    again_s: float
    """The same of one that has it."""


def speed(plant: Plant) -> Speed:
    """All of it, measured."""
    with tempfile.TemporaryDirectory() as cache:
        cold_s, again_s = ready_s(plant.name, Path(cache)), ready_s(plant.name, Path(cache))
    crowd = _crowd(plant)
    took = []
    for _ in range(4):
        began = time.perf_counter()
        simulate(plant.model.kernel, crowd, plant.model.states.__getitem__)
        took.append(time.perf_counter() - began)
    return Speed(min(took[1:]), cold_s, again_s)


def _crowd(plant: Plant) -> Batch:
    """An hour of many members as designed, each with noise of its own."""
    model, ticks = plant.model, plant.description.timing.ticks(3600.0)
    parameters = np.array([plant.true_parameters(1, spread=0.0)])
    none = np.zeros((MEMBERS, len(model.faults)))
    return Batch(
        state=np.repeat(model.initial_state(parameters[0])[None], MEMBERS, axis=0),
        parameters=np.repeat(parameters, MEMBERS, axis=0),
        severity=none,
        onset_s=none.copy(),
        inputs=np.tile(plant.start, (1, ticks, 1)),
        input_of=np.zeros(MEMBERS, dtype=np.int64),
        start_s=0.0,
        steps=ticks,
        stride=ticks,
        record=(0,),
        seeds=np.arange(MEMBERS, dtype=np.int64),
        process_noise=np.ones(MEMBERS),
        sensor_noise=np.ones(MEMBERS),
    )
