"""Which limits hold when: those of start-up while it lasts, every limit from then on."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Criterion, Limit, Limits
from homeostat.domain.plant.rules import StartUp
from homeostat.domain.snapshot import Trajectory
from homeostat.process.types import Vec
from homeostat.record.run_record import Span
from homeostat.stl.formula import Formula


@dataclass(frozen=True, slots=True)
class LimitsInForce:
    """The limits of one run; ``margins`` knows which of them hold at which of its moments."""

    limits: Limits
    """Limits that hold outside start-up."""
    start_up: StartUp = field(default_factory=StartUp)
    """What holds instead of some of them during start-up."""
    spans: tuple[Span, ...] = ()
    """When the limits of start-up held, both ends included [s]."""

    @classmethod
    def after(cls, plant: PlantDescription, started_s: float) -> Self:
        """Those of a plant whose start-up ended at ``started_s`` [s]."""
        return cls(plant.limits, plant.start_up, ((-math.inf, started_s),))

    def starting(self, truth: Trajectory) -> NDArray[np.bool_]:
        """At which moments of ``truth`` the limits of start-up hold."""
        found = np.zeros(truth.times_s.size, dtype=np.bool_)
        for first_s, last_s in self.spans:
            found |= (truth.times_s >= first_s) & (truth.times_s <= last_s)
        return found

    def margins(self, limit: Limit | Criterion, truth: Trajectory, scales: Mapping[str, float] | None = None) -> Vec:
        """Margin of ``limit`` at every moment, infinite where it does not hold; in ``scales`` of units where given.

        During start-up its own limits take the place of others, and hard ones without such hold as they are.
        """
        usual, starting = _margins(limit.formula, truth, scales), self.starting(truth)
        if not starting.any():
            return usual
        instead = self.start_up.limits.get(limit.name)
        if instead is not None:
            return np.where(starting, _margins(instead.formula, truth, scales), usual)
        return usual if limit.hard else np.where(starting, np.inf, usual)

    def outside(self, limit: Limit, truth: Trajectory) -> NDArray[np.bool_]:
        """At which moments ``truth`` is outside ``limit``, or cannot be judged."""
        return ~(self.margins(limit, truth) >= 0.0)

    def settled_s(self, at_s: float) -> float:
        """End of the start-up that ``at_s`` lies in, ``at_s`` itself where it lies in none [s]."""
        return max([last for first, last in self.spans if first <= at_s <= last], default=at_s)


def in_force(
    plant: PlantDescription, states: Sequence[tuple[str, float]], begin_s: float, start_ups: Sequence[Span] = ()
) -> LimitsInForce:
    """The limits of a run that began at ``begin_s`` and entered ``states``, each at its process time [s].

    ``start_ups`` are those that the guard told of, infinite where it told of no end; without any, a plant that begins
    in start-up leaves it with the first other state. None holds longer than the tables allow.
    """
    rules, spans = plant.start_up, list(start_ups)
    if not spans and plant.machine.initial.name in rules.states:
        left_s = next((at_s for state, at_s in states if state not in rules.states), math.inf)
        spans.append((begin_s, left_s))
    longest_s = max(rules.longest_s.values(), default=math.inf)
    return LimitsInForce(plant.limits, rules, tuple((first, min(last, first + longest_s)) for first, last in spans))


def _margins(formula: Formula, truth: Trajectory, scales: Mapping[str, float] | None) -> Vec:
    margins: Vec = np.broadcast_to(formula.margins(truth.signals, truth.dt_s), (1, truth.times_s.size))[0]
    scale = 1.0 if scales is None else scales.get(formula.unit, 1.0)
    return margins / scale
