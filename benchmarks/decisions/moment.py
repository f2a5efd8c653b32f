"""The best choice on the knowledge of a moment: what the twin of a first decision finds best, on the true plant.

The best constant and the best route know the true plant. Here every way on, with values on a grid that is made finer
around the best, is judged as the search judges: on the members that stood for what was known, by what forbids and by
what it costs. What that choice costs on the true plant is what deciding once, on that knowledge, comes to; a run that
goes on learning may do better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from benchmarks.decisions.decided import Decision, Problem, Values, first_decision
from benchmarks.decisions.routes import ways
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.alternatives import diverted_run
from homeostat.evaluate.reference.unsupervised import Unsupervised, unsupervised
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.costs import run_cost
from homeostat.plants.plant import Plant

LEVELS = 5
"""Values of each open command that are tried at first."""
FINER = (0.125, 0.0625)
"""Steps around the best one, in ranges [1], again and again."""
AT_ONCE = 50
"""Candidates that are rolled out in one call."""
Chosen: TypeAlias = tuple[float, ActionSet | None]
"""What a choice comes to by the search's own objective, and what is commanded; None is leaving the plant alone."""


@dataclass(frozen=True, slots=True)
class Informed:
    """What the best choice on the knowledge of the first decision came to on the true plant."""

    states: tuple[str, ...]
    """What it leads through; empty where the plant is left alone."""
    cost: float
    """What it costs from detection to the end of the run, in points of the design production."""


def best_informed(plant: Plant, chosen: Scenario, healthy: Trajectory, from_s: float) -> Informed | None:
    """The best choice on the knowledge of the first decision of a run of ``chosen``, priced from ``from_s`` [s] on.

    None where the run comes to no decision, or the choice leads out of the physical world.
    """
    decided = first_decision(plant, chosen)
    if decided is None:
        return None
    _, actions = cheapest(decided)
    at_s = decided.situation.snapshot.at_s
    run = unsupervised(plant, chosen) if actions is None else diverted_run(plant, chosen, at_s, actions)
    return None if run is None else _priced(plant, run, healthy, from_s, actions)


def cheapest(decided: Decision) -> Chosen:
    """What costs least of leaving the plant alone and of every way on, by the search's own objective."""
    plant, now = decided.plant, decided.situation
    release = plant.prices.release / plant.prices.worth(decided.twin.settings.horizon_s)
    found: list[Chosen] = [(Problem(decided).alone(), None)]
    for path in {p.commanded: p for p in ways(plant, now.state, now.snapshot)}.values():
        problem = Problem(replace(decided, path=path))
        point, least = _least(problem)
        found.append((least + release, problem.actions(point)))
    return min(found, key=lambda each: each[0])


def _least(problem: Problem) -> tuple[Values, float]:
    """The best point of the unit cube, and its value."""
    points = problem.grid(LEVELS)
    values = _values(problem, points)
    for step in FINER:
        around = problem.around(points[int(np.argmin(values))], step)
        points, values = np.vstack([points, around]), np.append(values, _values(problem, around))
    best = int(np.argmin(values))
    return points[best], float(values[best])


def _values(problem: Problem, points: Values) -> Values:
    return np.concatenate([problem(points[k : k + AT_ONCE]) for k in range(0, len(points), AT_ONCE)])


def _priced(plant: Plant, run: Unsupervised, healthy: Trajectory, from_s: float, actions: ActionSet | None) -> Informed:
    releases, states = (0, ()) if actions is None else (1, actions.states)
    cost = run_cost(plant, run.truth, healthy, from_s, run.states, releases)
    return Informed(states, 100.0 * cost.share)
