"""Plants that nobody watches: how a scenario goes by itself, and the fault-free run that scores are relative to."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.evaluate.scenario import Scenario
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.links.simulated import SimulatedLink
from homeostat.links.true_process import PlantConfiguration, TrueProcess
from homeostat.plants.assembly import new_sequencer
from homeostat.plants.plant import Plant
from homeostat.process.seeds import Stream, noise_seed

MOST = 32
"""Most fault-free runs that are kept in memory; one of the reactor takes about 3 MB."""
_healthy: OrderedDict[tuple[int, int, float], tuple[Plant, Unsupervised]] = OrderedDict()


@dataclass(frozen=True, slots=True)
class Unsupervised:
    """A run in which nobody acts but the sequencer."""

    truth: Trajectory
    """True values."""
    states: tuple[tuple[str, float], ...]
    """States of the machine, each with the process time at which it was entered [s]."""


class BasicControl(Protocol):
    """What a simulated plant is commanded by design, without anybody who supervises it."""

    def sample(self, snapshot: Snapshot) -> tuple[Command, ...]:
        """Commands after ``snapshot``."""
        ...


class Steered:
    """Implements :class:`BasicControl` over a sequencer, and gives commands of its own once: what hindsight tries."""

    def __init__(self, sequencer: Sequencer, at_s: float, commands: tuple[Command, ...]) -> None:
        """``commands`` are given after the first snapshot at ``at_s`` [s] or later."""
        self._sequencer, self._at_s, self._left = sequencer, at_s, commands

    def sample(self, snapshot: Snapshot) -> tuple[Command, ...]:
        """The sequencer's commands, and once the others."""
        own = self._sequencer.sample(snapshot)
        if snapshot.at_s < self._at_s or not self._left:
            return own
        given, self._left = self._left, ()
        return (*own, *given)


class Diverted:
    """Implements :class:`BasicControl` over a sequencer whose steps something else takes the place of at some time."""

    def __init__(self, sequencer: Sequencer, at_s: float, actions: ActionSet, aborting: bool) -> None:
        """``actions`` take over after the first snapshot at ``at_s`` [s] or later; ``aborting``: as a fallback does."""
        self._sequencer, self._at_s, self._aborting = sequencer, at_s, aborting
        self._actions: ActionSet | None = actions

    def sample(self, snapshot: Snapshot) -> tuple[Command, ...]:
        """The sequencer's commands, and once those that take over."""
        own = self._sequencer.sample(snapshot)
        if self._actions is None or snapshot.at_s < self._at_s:
            return own
        actions, self._actions = self._actions, None
        self._sequencer.stop()
        self._sequencer.load(actions, snapshot.at_s, aborting=self._aborting)
        return (*own, *actions.commands)


def open_process(plant: Plant, scenario: Scenario) -> TrueProcess:
    """The true process of a scenario: its own true parameters, its faults, its noise."""
    configuration = PlantConfiguration(
        parameters=plant.true_parameters(scenario.seed),
        inputs=plant.start,
        faults=scenario.faults,
        end_s=scenario.end_s,
        noise_seed=noise_seed(scenario.seed, Stream.TRUTH_NOISE),
    )
    return TrueProcess(plant.model, plant.description, configuration)


def watch(
    process: TrueProcess, basic: BasicControl, until: Callable[[Snapshot], object] = lambda snapshot: False
) -> TrueProcess:
    """Let ``process`` run to its end, or until a snapshot makes ``until`` true, commanded by ``basic`` alone."""
    link = SimulatedLink(process, recipe=basic.sample)
    while not link.ended:
        if until(link.advance()):
            break
    return process


def run_unsupervised(plant: Plant, scenario: Scenario) -> Trajectory:
    """True values of a scenario in which nobody acts."""
    return unsupervised(plant, scenario).truth


def unsupervised(plant: Plant, scenario: Scenario) -> Unsupervised:
    """A scenario in which nobody acts."""
    sequencer = new_sequencer(plant)
    process = watch(open_process(plant, scenario), sequencer)
    return Unsupervised(process.truth(), tuple(sequencer.drain()))


def fault_free(plant: Plant, seed: int, end_s: float) -> Unsupervised:
    """The fault-free run of the plant that ``seed`` stands for; the last ones are remembered, as runs share them."""
    key = id(plant), seed, end_s
    if key not in _healthy:
        _healthy[key] = plant, unsupervised(plant, Scenario(plant.name, (), seed, end_s))  # the plant keeps its number
        if len(_healthy) > MOST:
            _healthy.popitem(last=False)
    return _healthy[key][1]
