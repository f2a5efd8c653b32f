"""A hydraulic skid whose relief has never opened, and a twin that has followed it until its supply valve got weak."""

from __future__ import annotations

import functools
from pathlib import Path

from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Situation
from homeostat.agents.search.action import SearchAction
from homeostat.agents.simulation import TwinSimulation
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.seeds import Stream, noise_seed
from homeostat.twin.twin import Twin
from tests.twin.followed import follow

ONSET_S, NOW_S = 1402.0, 1410
WEAK = FaultState("V2_weak", 0.5, ONSET_S)
DIAGNOSIS = Diagnosis(float(NOW_S), (), (Hypothesis((WEAK,), 1.0),))
RELIEF = "V3"
LIMIT = 250.0
"""Pressure that the accumulator bears [bar]."""


@functools.cache
def skid() -> Plant:
    return load_plant(str(Path(__file__).parent / "skid"), learned=False, kept=False)


@functools.cache
def readings(*faults: FaultState) -> tuple[Snapshot, ...]:
    """Every snapshot of an unsupervised run until now."""
    plant, noise = skid(), noise_seed(1, Stream.TRUTH_NOISE)
    told = PlantConfiguration(plant.true_parameters(1), plant.start, faults, float(NOW_S), noise)
    link = SimulatedLink(TrueProcess(plant.model, plant.description, told))
    return tuple(link.advance() for _ in range(NOW_S))


def twin(*faults: FaultState) -> Twin:
    return follow(readings(*faults), plant=skid())


def situation() -> Situation:
    return Situation(readings(WEAK)[-1], DIAGNOSIS, "normal", readings(WEAK))


def adjust() -> RecoveryPath:
    machine = skid().description.machine
    return RecoveryPath(
        machine, (next(t for t in machine.transitions if (t.source, t.target) == ("normal", "adjusted")),)
    )


def raised(**values: float) -> ActionSet:
    """The design of the state, and what is commanded otherwise; ``p1_sp``: to the tag ``p1.sp``."""
    design = {"p1.sp": 200.0, "p3.sp": 240.0, "F2.sp": 1.0} | {k.replace("_", "."): v for k, v in values.items()}
    tags = skid().description.tags_by_name
    return ActionSet(tuple(Command(tag, value, tags[tag].rate_limit) for tag, value in design.items()), "adjusted")


def search(on: Twin) -> SearchAction:
    d = skid().description
    return SearchAction(on, d, Pricing(skid().prices, d.limits, d.scales))


def simulation(on: Twin) -> TwinSimulation:
    d = skid().description
    return TwinSimulation(on, d.tags_by_name, d.limits)
