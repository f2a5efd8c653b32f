"""One run with everything on, and what it cost against the best that could be done and against nobody acting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.decisions.moment import best_informed
from benchmarks.decisions.routes import best_route_from
from benchmarks.unknown.causes import Cause
from homeostat.agents.search.candidates import SearchSpace
from homeostat.domain.cost import Cost
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate import runner
from homeostat.evaluate.reference.best_constant import BestConstant, Grid, best_constant
from homeostat.evaluate.reference.unsupervised import Unsupervised, fault_free, unsupervised
from homeostat.evaluate.scenario import Fault, Scenario, departing, scenario_of
from homeostat.evaluate.score.costs import run_cost
from homeostat.evaluate.score.limits_in_force import LimitsInForce, in_force
from homeostat.evaluate.score.outcome import completion_s
from homeostat.evaluate.score.scoring import made, outside_after
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant

LEVELS = 7
"""Values of each setpoint that the best constant is looked for in at first."""
FINER = (5, 5)
"""Values between the neighbours of the best one, again and again."""
FAR = 8.0
"""Points by which a run may cost more than the best; of every other one it is asked what could be known."""


@dataclass(frozen=True, slots=True)
class Decision:
    """What one run came to; costs are in points of the design production from detection on."""

    fault: str
    severity: float
    onset_s: float
    seed: int
    outcome: str
    detected_s: float | None
    releases: int
    cost: float | None
    """Points; None where nothing was detected."""
    best: float | None
    """Points of the best constant, or of the best route; None where none keeps every hard limit."""
    alone: float | None
    """Points with nobody acting; None where that violates a hard limit."""
    outside_s: float
    """Seconds outside a hard limit from detection on [s]."""
    items: dict[str, float]
    """What the run paid for, in points."""
    informed: float | None = None
    """Points of the best choice on the knowledge of the first decision, of a run that costs :data:`FAR` more than the
    best; None of every other one, and where there was no choice."""


def measure(plant: Plant, cause: Cause, seed: int, mismatch: str, end_s: float | None = None) -> Decision:
    """Run a fault of the tables with everything on, until ``end_s`` [s]; thinking costs one second."""
    faults = [Fault(f.fault, f.severity, f.onset_s) for f in cause.faults]
    chosen = departing(plant, scenario_of(plant, faults, seed, end_s), (), mismatch)
    run = runner.run(plant, chosen, MemoryTrace(), DeclaredClock(1.0))
    (state,) = cause.faults
    told = (state.fault, state.severity, state.onset_s, seed, run.outcome.value, run.detected_s)
    if run.detected_s is None:
        return Decision(*told, 0, None, None, None, 0.0, {})
    from_s = math.ceil(run.detected_s) + 1.0
    usual = fault_free(plant, chosen)
    healthy = usual.truth
    own = run_cost(plant, run.truth, healthy, from_s, run.record.states, len(run.record.released))
    left = unsupervised(plant, chosen)
    force = in_force(plant.description, left.states, left.truth.start_s)
    kept = not outside_after(left.truth, force, from_s)
    alone = run_cost(plant, left.truth, healthy, from_s, left.states)
    best = _least(plant, chosen, usual, from_s)
    far = best is not None and _points(own) - best > FAR
    informed = best_informed(plant, chosen, healthy, from_s) if far else None
    return Decision(
        *told,
        len(run.record.released),
        _points(own),
        best,
        _points(alone) if kept else None,
        outside_s(run.truth, run.force, run.detected_s),
        {item.name: 100.0 * item.amount / own.worth for item in own.items},
        None if informed is None else informed.cost,
    )


def _least(plant: Plant, chosen: Scenario, usual: Unsupervised, from_s: float) -> float | None:
    """Points of the best that could be done from ``from_s`` [s] on, by hindsight; None where nothing is safe.

    Of a batch, which ``usual`` completes, the best route; else the best constant.
    """
    healthy = usual.truth
    if completion_s(plant, usual.states) is not None:
        route = best_route_from(plant, chosen, healthy, from_s)
        return None if route is None else route.cost
    best = _best(plant, chosen, from_s)
    worth = plant.prices.product * made(healthy, plant.delivered, from_s)
    return None if best.setpoints is None else 100.0 * (best.cost + plant.prices.release) / worth


def _points(cost: Cost) -> float:
    return 100.0 * cost.share


def outside_s(truth: Trajectory, force: LimitsInForce, from_s: float) -> float:
    """Seconds outside any hard limit from ``from_s`` [s] on."""
    found = outside_after(truth, force, from_s)
    return float(len({float(at_s) for times in found.values() for at_s in times})) * truth.dt_s


def _best(plant: Plant, chosen: Scenario, from_s: float) -> BestConstant:
    """The best constant of everything that a search may command in any state, manual outputs too."""
    tags = plant.description.tags_by_name
    ranges: dict[str, SetpointRange] = {}
    for state in plant.description.machine.states:
        if state.recovery_target:
            for r in SearchSpace(state, tags).ranges:
                known = ranges.get(r.tag, r)
                design = known.design if known.design is not None else r.design
                ranges[r.tag] = SetpointRange(r.tag, min(known.low, r.low), max(known.high, r.high), design)
    grid: Grid = {r.tag: _levels(r) for r in ranges.values() if r.high > r.low}
    best = best_constant(plant, chosen, from_s, grid)
    for count in FINER:
        if best.setpoints is None:
            return best
        grid = {tag: _between(values, best.setpoints[tag], count) for tag, values in grid.items()}
        finer = best_constant(plant, chosen, from_s, grid)
        best = finer if finer.setpoints is not None and finer.cost < best.cost else best
    return best


def _levels(r: SetpointRange) -> tuple[float | None, ...]:
    values = np.linspace(r.low, r.high, LEVELS if r.tag != "XV1.cmd" else 2).tolist()
    return (None, *values) if r.design is None else tuple(sorted({*values, r.design}))


def _between(values: Sequence[float | None], best: float | None, count: int) -> tuple[float | None, ...]:
    """``count`` values between the neighbours of ``best`` in ``values``, and itself; automatic stays what it is."""
    if best is None:
        return (None,)
    ordered = sorted(v for v in values if v is not None)
    at = ordered.index(best)
    ends = ordered[max(at - 1, 0)], ordered[min(at + 1, len(ordered) - 1)]
    return tuple(sorted({best, *np.linspace(*ends, count).tolist()}))
