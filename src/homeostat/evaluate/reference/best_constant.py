"""A reference policy: the cheapest constant setpoints that an exhaustive grid finds on the true plant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeAlias

import numpy as np

from homeostat.agents.pricing import Pricing
from homeostat.domain.recovery import Command
from homeostat.evaluate.reference.unsupervised import true_plant
from homeostat.evaluate.scenario import Scenario
from homeostat.links.truth.members import Members
from homeostat.plants.plant import Plant
from homeostat.process.schedule import InputRamp
from homeostat.process.types import Cube, Table, Vec

STRIDE = 5
"""Every how many ticks the true plant is looked at."""
CHUNK = 600
"""Grid points that are simulated at once, to bound the memory."""


@dataclass(frozen=True, slots=True)
class BestConstant:
    """The best admissible point of a grid."""

    setpoints: Mapping[str, float | None] | None
    """Setpoint tag -> value, None for automatic; None where no point is admissible."""
    cost: float
    """What it costs from the release to the end of the run, in the plant's currency; NaN where none is admissible."""
    admissible: int
    """Number of admissible points."""
    points: int
    """Number of points."""


Grid: TypeAlias = Mapping[str, Sequence[float | None]]
"""Setpoint tag -> values that are tried; None leaves a manual output on automatic."""


def best_constant(plant: Plant, scenario: Scenario, released_s: float, grid: Grid) -> BestConstant:
    """The point of ``grid`` that costs least on the true plant, by the prices that decisions are made by.

    The setpoints are ramped from ``released_s`` on, at their rate limits, and then stay. A point is admissible if the
    true plant keeps every hard limit to the end of the run, and stays in the physical world; it sees the very faults,
    parameters and noise of the scenario. What a state costs is not in it: a constant is in none.
    """
    members = Members(plant.model, plant.description, true_plant(plant, scenario))
    state = _state_at(plant, members, released_s)
    points = list(product(*grid.values()))
    steps = plant.description.timing.whole_ticks(scenario.end_s - released_s)
    cost = np.full(len(points), np.inf)
    for first in range(0, len(points), CHUNK):
        chunk = points[first : first + CHUNK]
        schedules = np.stack([_schedule(plant, dict(zip(grid, p, strict=True)), steps) for p in chunk])
        cost[first : first + CHUNK] = _try(plant, members, released_s, state, schedules)
    best = int(np.argmin(cost))
    if not np.isfinite(cost[best]):
        return BestConstant(None, float("nan"), 0, len(points))
    found = dict(zip(grid, points[best], strict=True))
    return BestConstant(found, float(cost[best]), int(np.isfinite(cost).sum()), len(points))


def _state_at(plant: Plant, members: Members, at_s: float) -> Vec:
    """State of the unsupervised plant at ``at_s`` [s]."""
    ticks = plant.description.timing.whole_ticks(at_s)
    inputs = np.tile(plant.start, (1, ticks, 1))
    return np.asarray(members.simulate(members.start()[None], inputs, 0.0, ticks, 1).state[0])


def _schedule(plant: Plant, point: Mapping[str, float | None], steps: int) -> Table:
    ramp = InputRamp(plant.model.inputs, plant.start, plant.description.timing.tick_s)
    tags = plant.description.tags_by_name
    given = {t: v for t, v in point.items() if v is not None}
    commands = tuple(Command(t, v, tags[t].rate_limit) for t, v in given.items())
    ramp.command(commands, plant.description.variables, {})
    return ramp.schedule(steps)


def _try(plant: Plant, members: Members, released_s: float, state: Vec, schedules: Cube) -> Vec:
    """What each schedule costs, infinite where a hard limit is not kept, shape (schedules,)."""
    states = np.tile(state, (len(schedules), 1))
    result = members.simulate(states, schedules, released_s, schedules.shape[1], STRIDE, refuse=False)
    sampled = schedules[:, STRIDE - 1 :: STRIDE][:, : result.record.shape[1]]
    truth = plant.model.truth(result.record, sampled)
    start = plant.model.truth(state[None, None, : len(plant.model.states)], plant.start[None, None])
    variables = plant.description.variables
    produced = [variables.get(d, d) for d in plant.delivered]
    made = sum(truth[v][:, -1] - float(start[v][0, 0]) for v in produced)
    signals, tick_s = {tag: truth[v] for tag, v in variables.items()}, plant.description.timing.tick_s
    pricing = Pricing(plant.prices, plant.description.limits, plant.description.scales)
    cost = np.maximum(plant.prices.worth(schedules.shape[1] * tick_s) - plant.prices.product * made, 0.0)
    for price in pricing.outside(signals, STRIDE * tick_s).values():
        cost = cost + price
    for limit in plant.description.limits.hard:
        kept = limit.formula.margins(signals, STRIDE * tick_s).min(axis=1) >= 0.0
        cost = np.where(kept, cost, np.inf)
    return np.asarray(cost)
