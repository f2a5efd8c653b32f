"""What was possible: an exhaustive search on the true plant, with the true faults known from their onset on."""

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from homeostat.domain.recovery import Command
from homeostat.evaluate.reference.best_constant import STRIDE, best_constant
from homeostat.evaluate.reference.best_route import best_route, sequencer_along
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run_steered
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.study.plan.plants import plant_of
from homeostat.evaluate.study.row_of import row_of, succeeded
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.record.row import HINDSIGHT, Row

LEVELS = 7
"""Values of each setpoint that are tried at first."""
FINER = (5, 5, 5)
"""Values that are tried between the neighbours of the best one, again and again."""


def hindsight_row(job: Job) -> Row:
    """The row of the best that could have been done; no success where nothing admissible was found.

    For a batch every route and speed from the start; otherwise every set of constant setpoints from the onset on. Where
    none of them keeps every limit, nothing at all, if the plant comes back by itself.
    """
    begin = time.monotonic()
    plant, chosen = plant_of(job), job.scenario
    idle = run_steered(plant, chosen, new_sequencer(plant))
    found = _best_batch(plant, chosen) if idle.nominal_s is not None else _best_setpoints(plant, chosen)
    if found is None and succeeded(idle):
        found = idle  # limits are violated whatever is done, and the plant comes back by itself
    row = row_of(job, found or idle, "")
    outcome = "possible" if found else "impossible"
    return replace(row, success=found is not None, actor=HINDSIGHT, outcome=outcome, wall_s=time.monotonic() - begin)


def _best_batch(plant: Plant, chosen: Scenario) -> Run | None:
    best = best_route(plant, chosen)
    if best is None:
        return None
    return run_steered(plant, chosen, sequencer_along(plant, best.path, best.values))


def _best_setpoints(plant: Plant, chosen: Scenario) -> Run | None:
    if chosen.onset_s is None:
        return None
    timing = plant.description.timing
    # The first tick at which anything can be commanded.
    onset_s = timing.at_s(max(1, math.ceil(chosen.onset_s / timing.tick_s)))
    if chosen.end_s - onset_s < STRIDE * timing.tick_s:
        return None  # too late for anything
    choices = max((s.open_setpoints for s in plant.description.machine.states if s.recovery_target), key=len)
    grid = {r.tag: _levels(r.low, r.high, LEVELS, r.design) for r in choices}
    best = best_constant(plant, chosen, onset_s, grid)
    for count in FINER:
        if best.setpoints is None:
            return None
        grid = {tag: _between(values, best.setpoints[tag], count) for tag, values in grid.items()}
        finer = best_constant(plant, chosen, onset_s, grid)
        best = min(best, finer, key=lambda found: math.inf if found.setpoints is None else found.cost)
    assert best.setpoints is not None  # the finer grids hold the best point of the one before
    tags = plant.description.tags_by_name
    commands = tuple(Command(tag, value, tags[tag].rate_limit) for tag, value in best.setpoints.items())
    return run_steered(plant, chosen, new_sequencer(plant), onset_s, commands)


def _levels(low: float, high: float, count: int, design: float | None) -> tuple[float | None, ...]:
    """``count`` values from ``low`` to ``high``, and ``design``; automatic first where that is the design."""
    values = {*np.linspace(low, high, count).tolist()}
    return (None, *sorted(values)) if design is None else tuple(sorted({*values, design}))


def _between(values: Sequence[float | None], best: float | None, count: int) -> tuple[float | None, ...]:
    """``count`` values between the neighbours of ``best`` in ``values``, and itself; automatic stays what it is."""
    if best is None:
        return (None,)
    ordered = sorted(v for v in values if v is not None)
    at = ordered.index(best)
    low, high = ordered[max(at - 1, 0)], ordered[min(at + 1, len(ordered) - 1)]
    return _levels(low, high, count, best)
