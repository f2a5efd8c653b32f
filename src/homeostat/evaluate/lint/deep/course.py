"""One simulated course of a plant: what its instruments said, what was true, and the states that it came through."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.plant.limits import Limit
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.batch import ProcessError
from homeostat.process.types import Vec
from homeostat.stl.deciding import amount
from homeostat.stl.formula import Formula
from homeostat.stl.signals import SignalMap

Act: TypeAlias = Callable[[Snapshot], ActionSet | None]
"""What is carried out after a snapshot in place of the recipe, once and for all; None for not yet."""


@dataclass(frozen=True, slots=True)
class Course:
    """What came of one simulated run in which nobody acts but the recipe, or one set of actions."""

    plant: Plant
    """The plant."""
    seen: tuple[Snapshot, ...]
    """What its instruments said, one snapshot per tick."""
    truth: Trajectory
    """True values, one member."""
    states: tuple[tuple[str, float], ...]
    """States of the machine, each with the process time at which it was entered [s]."""
    acted_s: float
    """When the actions were commanded [s]; infinite where none were."""
    broke: str
    """Why it ended early; empty where it did not."""
    end: tuple[Vec, Vec]
    """True state, shape (states,), and inputs, shape (inputs,), at its end."""

    @property
    def started_s(self) -> float:
        """End of start-up [s]; infinite where there was none."""
        rules = self.plant.description.start_up.states
        return next((at_s for state, at_s in self.states if state not in rules), math.inf)

    @property
    def last_state(self) -> str:
        """State of the machine at its end."""
        return self.states[-1][0] if self.states else self.plant.description.machine.initial.name

    @property
    def stays(self) -> tuple[tuple[str, float, float], ...]:
        """States of the machine, each with when it was entered and left [s]; the last one is never left."""
        ends = (*(at_s for _, at_s in self.states[1:]), math.inf)
        return tuple((state, at_s, end_s) for (state, at_s), end_s in zip(self.states, ends, strict=False))

    @property
    def settled_s(self) -> float:
        """When it is judged from: start-up and what monitoring waits are over [s]."""
        return self.started_s + self.plant.monitoring.settle_s

    def true(self, tag: str) -> Vec:
        """True values of ``tag``, shape (times,)."""
        return np.asarray(self.truth.signals[tag][0])

    def read(self, tag: str) -> Vec:
        """What the instrument of ``tag`` said, shape (times,)."""
        return np.array([snapshot.values[tag] for snapshot in self.seen])

    def lasts_s(self, moments: NDArray[np.bool_]) -> float:
        """How long so many moments are together [s]."""
        return float(moments.sum()) * self.truth.dt_s

    def after(self, at_s: float) -> NDArray[np.bool_]:
        """Which moments are later than ``at_s`` [s], shape (times,)."""
        return np.asarray(self.truth.times_s > at_s)

    def margins(self, limit: Limit) -> Vec:
        """True margin of ``limit`` at every moment, that of start-up while it lasts, shape (times,)."""
        return LimitsInForce.after(self.plant.description, self.started_s).margins(limit, self.truth)

    def outside(self, limit: Limit) -> NDArray[np.bool_]:
        """At which moments ``limit`` is violated, shape (times,)."""
        return ~(self.margins(limit) >= 0.0)


@dataclass(frozen=True, slots=True)
class Setting:
    """How a course is run."""

    parameters: Vec
    """True parameters, shape (parameters,)."""
    noise: float = 0.0
    """Scale of all noise."""
    seed: int = 1
    """Seed of it."""
    faults: tuple[FaultState, ...] = ()
    """What is wrong."""
    end_s: float | None = None
    """Its end [s]; that of the plant's runs where None."""
    wandering: float = 1.0
    """Scale of what comes from outside and varies, beside ``noise`` [1]."""


def told_margin(formula: Formula, signals: SignalMap, margins: Vec, best: bool) -> str:
    """The ``best`` of ``margins`` at the moments of ``signals``, or the worst, in the unit of what decides it."""
    usable = np.where(np.isfinite(margins), margins, -np.inf if best else np.inf)
    row = int(np.argmax(usable) if best else np.argmin(usable))
    values = {tag: float(np.atleast_2d(signals[tag])[0, row]) for tag in formula.tags}
    margin = float(margins[row])
    return f"{'-' if margin < 0.0 else ''}{amount(formula, values, margin)}"


def run(plant: Plant, setting: Setting, act: Act = lambda seen: None) -> Course:
    """Simulate; where the plant leaves the physical world, the course ends and says so."""
    end_s = plant.end_s if setting.end_s is None else setting.end_s
    own = (setting.parameters, plant.start, setting.faults, end_s, setting.seed, setting.noise)
    configuration = PlantConfiguration(*own, wandering=setting.wandering)
    process = TrueProcess(plant.model, plant.description, configuration)
    recipe = _Recipe(new_sequencer(plant), act)
    link = SimulatedLink(process, recipe=recipe)
    seen, broke = [], ""
    try:
        while not link.ended:
            seen.append(link.advance())
    except ProcessError as error:
        broke = str(error)
    tick_s = plant.description.timing.tick_s
    truth = process.truth() if seen else Trajectory(tick_s, tick_s, {})
    return Course(plant, tuple(seen), truth, tuple(recipe.sequencer.drain()), recipe.acted_s, broke, process.reached)


class _Recipe:
    """The plant's own recipe until something else is carried out."""

    def __init__(self, sequencer: Sequencer, act: Act) -> None:
        self.sequencer, self._act, self.acted_s = sequencer, act, math.inf

    def __call__(self, seen: Snapshot) -> tuple[Command, ...]:
        actions = self._act(seen) if math.isinf(self.acted_s) else None
        if actions is None:
            return self.sequencer.sample(seen)
        self.acted_s = seen.at_s
        self.sequencer.load(actions, seen.at_s, aborting=True)
        return actions.commands
