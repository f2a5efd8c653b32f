"""Plants that nobody watches: how a scenario goes by itself, and the fault-free run that scores are relative to."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.evaluate.scenario import Scenario
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import Departed, PlantConfiguration, TrueProcess
from homeostat.plants.plant import Plant
from homeostat.plants.truth import Mismatch, find_mismatch, true_model
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.seeds import Stream, noise_seed

MOST = 32
"""Most fault-free runs that are kept in memory; one of the reactor takes about 3 MB."""
Recipe: TypeAlias = Callable[[Snapshot], tuple[Command, ...]]
"""What a simulated plant is commanded by design after a snapshot, without anybody who supervises it."""
_healthy: OrderedDict[tuple[int, Scenario], tuple[Plant, Unsupervised]] = OrderedDict()


@dataclass(frozen=True, slots=True)
class Unsupervised:
    """A run in which nobody acts but the sequencer."""

    truth: Trajectory
    """True values."""
    states: tuple[tuple[str, float], ...]
    """States of the machine, each with the process time at which it was entered [s]."""


def once(sequencer: Sequencer, at_s: float, act: Callable[[float], tuple[Command, ...]]) -> Recipe:
    """What ``sequencer`` commands and, after the first snapshot at ``at_s`` [s] or later, what ``act`` gives then."""
    waits = True

    def sample(snapshot: Snapshot) -> tuple[Command, ...]:
        nonlocal waits
        own = sequencer.sample(snapshot)
        if not waits or snapshot.at_s < at_s:
            return own
        waits = False
        return (*own, *act(snapshot.at_s))

    return sample


def open_process(plant: Plant, scenario: Scenario) -> TrueProcess:
    """The true process of a scenario."""
    return TrueProcess(plant.model, plant.description, true_plant(plant, scenario))


def true_plant(plant: Plant, scenario: Scenario) -> PlantConfiguration:
    """What the plant of a scenario truly is: its own true parameters, its faults, its noise, and how it departs."""
    mismatch = find_mismatch(plant.model, scenario.mismatch)
    return PlantConfiguration(
        parameters=plant.true_parameters(scenario.seed, 1.0 if mismatch is None else mismatch.spread),
        inputs=plant.start,
        faults=scenario.faults,
        end_s=scenario.end_s,
        noise_seed=noise_seed(scenario.seed, Stream.TRUTH_NOISE),
        departed=_departed(plant, mismatch, scenario),
        repaired_s=math.inf if scenario.repaired_s is None else scenario.repaired_s,
    )


def _departed(plant: Plant, mismatch: Mismatch | None, scenario: Scenario) -> Departed | None:
    """How the true plant differs from its model; None where it does not, and what simulates it needs no more."""
    truth, disturbances = true_model(plant.model), scenario.disturbances
    if truth is None or (mismatch is None and not disturbances):
        return None
    seed = noise_seed(scenario.seed, Stream.TRUTH_COURSES)
    if mismatch is None:
        return Departed(truth, np.array(truth.departures.neutral()), disturbances, seed)
    return Departed(truth, mismatch.parameters, (*mismatch.drifts, *disturbances), seed)


def watch(
    process: TrueProcess, recipe: Recipe, until: Callable[[Snapshot], object] = lambda snapshot: False
) -> TrueProcess:
    """Let ``process`` run to its end, or until a snapshot makes ``until`` true, commanded by ``recipe`` alone."""
    link = SimulatedLink(process, recipe=recipe)
    while not link.ended:
        if until(link.advance()):
            break
    return process


def unsupervised(plant: Plant, scenario: Scenario) -> Unsupervised:
    """A scenario in which nobody acts."""
    sequencer = new_sequencer(plant)
    process = watch(open_process(plant, scenario), sequencer.sample)
    return Unsupervised(process.truth(), tuple(sequencer.drain()))


def fault_free(plant: Plant, scenario: Scenario) -> Unsupervised:
    """``scenario`` without faults and disturbances; the last ones are remembered, as runs share them."""
    chosen = scenario.undisturbed
    key = id(plant), chosen
    if key not in _healthy:
        _healthy[key] = plant, unsupervised(plant, chosen)  # the plant keeps its number
        if len(_healthy) > MOST:
            _healthy.popitem(last=False)
    return _healthy[key][1]
