"""Runs of the plant with everything on; one that was made for the present sources is not made again."""

from __future__ import annotations

import json
import math
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from benchmarks.host import kept
from benchmarks.tennessee.alone import Trip, left_alone
from benchmarks.tennessee.published import HOURS as ALONE_HOURS
from homeostat.domain.outcome import Outcome
from homeostat.domain.recovery import Command
from homeostat.evaluate.reference.best_answer import best_answer
from homeostat.evaluate.reference.best_constant import BestConstant
from homeostat.evaluate.runner import run, run_steered
from homeostat.evaluate.scenario import Scenario, departing, scenario
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer

HOURS = 8
"""How long a run goes on after the onset."""
MISMATCH = "plant"
"""How the true plant is not the model that its twin has."""
LEVELS, FINER = 5, (5,)
"""Values of each open setpoint that are tried by hindsight, and again near the best."""
THOUGHT_S = 60.0
"""What every thought takes of the process's time, so that runs are equal on any host [s]."""


@dataclass(frozen=True)
class Looked:
    """One fault with nobody, and looked after."""

    fault: str
    seed: int
    alone_h: float | None
    """From the onset to the first trip limit with nobody; None where all are kept [h]."""
    alone_limit: str
    outcome: str
    """How the run with everything on ended."""
    detected_s: float | None
    """From the onset to the first symptom [s]."""
    released_s: float | None
    """From the onset to the first release [s]."""
    lost: float | None
    """Share of the production since the onset [1]."""
    outside_s: float
    """Time outside a trip limit [s]."""
    cpu_s: float
    """CPU time of that run [s]."""
    kept_by: int
    """How many of the constant answers that were tried by hindsight keep every trip limit."""
    tried: int
    """How many were tried; 0 where nothing was, because nobody had to do anything."""
    best_lost: float | None
    """Share of the production since the onset that the cheapest of them loses [1]; None where there is none."""

    @property
    def trip(self) -> Trip:
        """How it ended with nobody."""
        return Trip(math.inf if self.alone_h is None else self.alone_h, self.alone_limit)


def looked(plant: Plant, fault: str, seed: int) -> Looked:
    """Both runs, from the cache where they are there."""
    file = Path(kept("tennessee")) / f"{fault}-{seed}.json"
    if not file.exists():
        found = _looked(plant, fault, seed)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(asdict(found), indent=1) + "\n", encoding="utf-8")
    return Looked(**json.loads(file.read_text(encoding="utf-8")))


def there(fault: str, seed: int) -> bool:
    """Whether :func:`looked` has it already."""
    return (Path(kept("tennessee")) / f"{fault}-{seed}.json").exists()


def _looked(plant: Plant, fault: str, seed: int) -> Looked:
    onset_s = plant.onset_s  # by then monitoring has its window; nothing is noticed before
    case = departing(plant, scenario(plant, fault, seed, onset_s, end_s=onset_s + 3600.0 * HOURS), mismatch=MISMATCH)
    nobody = left_alone(plant, replace(case, end_s=onset_s + 3600.0 * ALONE_HOURS)).trip
    began = time.process_time()
    done = run(plant, case, clock=DeclaredClock(THOUGHT_S)).result(Path())
    cpu_s = time.process_time() - began
    hard = {limit.name for limit in plant.description.limits.hard}
    acted = done.outcome is not Outcome.NO_ACTION
    best = best_answer(plant, case, done.detected_s or onset_s, LEVELS, FINER) if acted else None
    detected, released = (None if at is None else at - onset_s for at in (done.detected_s, done.released_s))
    return Looked(
        fault=fault,
        seed=seed,
        alone_h=nobody.hours if math.isfinite(nobody.hours) else None,
        alone_limit=nobody.limit,
        outcome=done.outcome.value.replace("_", " "),
        detected_s=detected,
        released_s=released,
        lost=done.production_loss,
        outside_s=sum(each.total_s for each in done.limit_exposure_s if each.limit in hard),
        cpu_s=cpu_s,
        kept_by=best.admissible if best else 0,
        tried=best.points if best else 0,
        best_lost=_lost(plant, case, best, done.detected_s or onset_s) if best else None,
    )


def _lost(plant: Plant, case: Scenario, best: BestConstant, at_s: float) -> float | None:
    """What the ``best`` answer loses of the production where it is given at ``at_s`` [s]; None where there is none."""
    if best.setpoints is None:
        return None
    tags = plant.description.tags_by_name
    commands = tuple(Command(tag, value, tags[tag].rate_limit) for tag, value in best.setpoints.items())
    return run_steered(plant, case, new_sequencer(plant), at_s, commands).production_loss
