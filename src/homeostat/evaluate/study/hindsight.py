"""What was possible: an exhaustive search on the true plant, with the true faults known from their onset on."""

import math
import time
from dataclasses import replace

from homeostat.domain.recovery import Command
from homeostat.evaluate.beginning import begun
from homeostat.evaluate.reference.best_answer import best_answer
from homeostat.evaluate.reference.best_constant import STRIDE
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


def hindsight_row(job: Job) -> Row:
    """The row of the best that could have been done; no success where nothing admissible was found.

    For a batch every route and speed from the start; otherwise constant setpoints of every recovery target from the
    onset on, or from the start where nothing is wrong but where the run begins, or what an operator has set. Where none
    of them keeps every limit, nothing at all, if the plant comes back by itself.
    """
    begin = time.monotonic()
    plant, chosen = begun(plant_of(job), job.scenario), job.scenario
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
    ordered = chosen.begins_in or chosen.setpoints
    begins_s = 0.0 if chosen.onset_s is None and ordered else chosen.onset_s
    if begins_s is None:
        return None  # nothing is wrong, and everything as it is by design
    timing = plant.description.timing
    # The first tick at which anything can be commanded.
    onset_s = timing.at_s(max(1, math.ceil(begins_s / timing.tick_s)))
    if chosen.end_s - onset_s < STRIDE * timing.tick_s:
        return None  # too late for anything
    best = best_answer(plant, chosen, onset_s)
    if best.setpoints is None:
        return None
    tags = plant.description.tags_by_name
    commands = tuple(Command(tag, value, tags[tag].rate_limit) for tag, value in best.setpoints.items())
    return run_steered(plant, chosen, new_sequencer(plant), onset_s, commands)
