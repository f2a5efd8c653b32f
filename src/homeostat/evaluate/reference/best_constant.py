"""A reference policy: the best constant setpoints that an exhaustive grid finds on the true plant."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.recovery import Command
from homeostat.evaluate.reference.unsupervised import true_plant
from homeostat.evaluate.scenario import Scenario
from homeostat.links.truth.members import Members
from homeostat.plants.plant import Plant
from homeostat.process.schedule import InputRamp
from homeostat.process.types import Cube, Table, Vec

STRIDE_S = 5
"""The true plant is sampled this often [s]."""
CHUNK = 600
"""Grid points that are simulated at once, to bound the memory."""


@dataclass(frozen=True, slots=True)
class BestConstant:
    """The best admissible point of a grid."""

    setpoints: Mapping[str, float] | None
    """Setpoint tag -> value; None where no point is admissible."""
    production_loss: float
    """Fraction of the fault-free production lost from the fault's onset to the end of the run [1]."""
    admissible: int
    """Number of admissible points."""
    points: int
    """Number of points."""


def best_constant(
    plant: Plant, scenario: Scenario, released_s: float, grid: Mapping[str, tuple[float, ...]], healthy_made: float
) -> BestConstant:
    """The point of ``grid`` (setpoint tag -> values) with the least production loss on the true plant.

    The setpoints are ramped from ``released_s`` on, at their rate limits, and then stay. A point is admissible if the
    true plant keeps every trip limit and envelope to the end of the run and meets every soft acceptance criterion; it
    sees the very faults, parameters and noise of the scenario. ``healthy_made`` is the fault-free production from the
    onset to the end, in the unit of the plant's delivered quantities.
    """
    members = Members(plant.model, plant.description, true_plant(plant, scenario))
    state, before = _state_at(plant, members, scenario, released_s)
    points = list(product(*grid.values()))
    steps = int(scenario.end_s - released_s)
    loss = np.full(len(points), np.inf)
    for first in range(0, len(points), CHUNK):
        chunk = points[first : first + CHUNK]
        schedules = np.stack([_schedule(plant, dict(zip(grid, p, strict=True)), state, steps) for p in chunk])
        made, good = _try(plant, members, released_s, state, schedules)
        loss[first : first + CHUNK] = np.where(good, 1.0 - (before + made) / healthy_made, np.inf)
    best = int(np.argmin(loss))
    if not np.isfinite(loss[best]):
        return BestConstant(None, float("nan"), 0, len(points))
    found = dict(zip(grid, points[best], strict=True))
    return BestConstant(found, float(loss[best]), int(np.isfinite(loss).sum()), len(points))


def _state_at(plant: Plant, members: Members, scenario: Scenario, at_s: float) -> tuple[Vec, float]:
    """State of the unsupervised plant at ``at_s``, and what it made since the onset."""
    inputs = np.tile(plant.start, (1, int(at_s), 1))
    result = members.simulate(members.start()[None], inputs, 0.0, int(at_s), 1)
    truth = plant.model.truth(result.record, inputs)
    onset = int(scenario.onset_s or at_s) - 1
    parts = [truth[_variable(plant, d)][0] for d in plant.delivered]
    return result.state[0], float(sum(p[-1] - p[onset] for p in parts))


def _variable(plant: Plant, name: str) -> str:
    return plant.description.variables.get(name, name)


def _schedule(plant: Plant, point: Mapping[str, float], state: Vec, steps: int) -> Table:
    ramp = InputRamp(plant.model.inputs, plant.start)
    tags = plant.description.tags_by_name
    ramp.command(tuple(Command(t, v, tags[t].rate_limit) for t, v in point.items()), plant.description.variables, {})
    return ramp.schedule(steps)


def _try(plant: Plant, members: Members, released_s: float, state: Vec, schedules: Cube) -> tuple[Vec, Vec]:
    """What each schedule makes, and whether it is admissible, shape (schedules,) each."""
    states = np.tile(state, (len(schedules), 1))
    result = members.simulate(states, schedules, released_s, schedules.shape[1], STRIDE_S)
    sampled = schedules[:, STRIDE_S - 1 :: STRIDE_S][:, : result.record.shape[1]]
    truth = plant.model.truth(result.record, sampled)
    start = plant.model.truth(state[None, None, : len(plant.model.states)], plant.start[None, None])
    produced = [_variable(plant, d) for d in plant.delivered]
    made = sum(truth[v][:, -1] - float(start[v][0, 0]) for v in produced)
    signals = {tag: truth[v] for tag, v in plant.description.variables.items()}
    good = np.ones(len(schedules), dtype=bool)
    for limit in plant.description.limits.limits:
        if limit.kind is not LimitKind.PERMISSIVE:
            good &= limit.formula.margins(signals, STRIDE_S).min(axis=1) >= 0.0
    for criterion in plant.description.limits.criteria:
        if not criterion.hard:
            good &= criterion.formula.evaluate(signals, STRIDE_S).value >= 0.0
    return np.asarray(made), good
