"""Runs of the plant with everything on; one that was made for the present sources is not made again."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.host import kept
from benchmarks.tennessee.alone import HIDDEN, Trip, Upset, left_alone, stuck, upsets
from benchmarks.tennessee.published import HOURS as ALONE_HOURS
from homeostat.domain.diagnosis import by_fault_set
from homeostat.domain.events.guard import Armed
from homeostat.domain.recovery import Command
from homeostat.evaluate.reference.best_answer import best_answer
from homeostat.evaluate.reference.best_constant import BestConstant
from homeostat.evaluate.run import Run, finite
from homeostat.evaluate.runner import run, run_steered
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.study.row_of import least_margin
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.process.batch import ProcessError
from homeostat.record.run_record import NOBODY

HOURS = 8
"""How long a run goes on after the onset."""
MISMATCH = "plant"
"""How the true plant is not the model that its twin has."""
LEVELS, FINER = 5, (5,)
"""Values of each open setpoint that are tried by hindsight, and again near the best."""
UNKNOWN = "unknown"
"""What the name of everything begins with that stands in no table."""
THOUGHT_S = 60.0
"""What every thought takes of the process's time, so that runs are equal on any host [s]."""


@dataclass(frozen=True)
class Asked:
    """One disturbance that is looked after."""

    name: str
    """What the page calls it."""
    upset: Upset
    """What happens."""


def everything(plant: Plant) -> list[Asked]:
    """Every published disturbance by itself, and every valve that sticks."""
    published = [Asked(f"IDV {idv}", upset) for idv, upset in upsets().items()]
    return [*published, *(Asked(name, upset) for name, upset in stuck(plant).items())]


@dataclass(frozen=True)
class Looked:
    """One disturbance with nobody, and looked after."""

    name: str
    told: str
    """What happens, in our words."""
    hidden: bool
    """Whether it stands in no table of the plant."""
    seed: int
    alone_h: float | None
    """From the onset to the first trip limit with nobody; None where all are kept [h]."""
    alone_limit: str
    outcome: str
    """How the run with everything on ended."""
    detected_s: float | None
    """From the onset to the first symptom [s]."""
    called: str
    """What was likeliest when something was released, or was said last; empty where nothing was."""
    probability: float | None
    """How likely that was [1]; None where nothing was said."""
    foreseen_s: float | None
    """From the onset to when something must have been done at the latest, as it was said first [s]; None for never."""
    released_s: float | None
    """From the onset to the first release [s]."""
    action: str
    """What was released first, or that a fallback acted; empty for nothing."""
    least_margin: float
    """Least true margin to a hard limit since start-up, in scales of its unit; negative: violated [1]."""
    least_margin_limit: str
    """Name of that limit."""
    lost: float | None
    """Share of the production since the onset [1]."""
    outside_s: float
    """Time outside a trip limit [s]."""
    decision_s: float | None
    """Time by the clock from the notice that led to the first action until that; None where nothing was done [s]."""
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

    @property
    def unknown(self) -> bool:
        """Whether it was called by no name of the tables, though something was said."""
        return self.called.startswith(UNKNOWN)


_LOST: Mapping[str, Any] = {
    "outcome": "no plant any more", "decision_s": None, "called": "", "probability": None, "action": "", "lost": None,
    "detected_s": None, "released_s": None, "foreseen_s": None, "outside_s": math.inf, "least_margin": -math.inf,
    "least_margin_limit": "",
}  # fmt: skip
"""What is known of a run in which the true plant goes where its model was not made for."""


def looked(plant: Plant, asked: Asked, seed: int) -> Looked:
    """Both runs, from the cache where they are there."""
    file = _file(asked, seed)
    if not file.exists():
        found = _looked(plant, asked, seed)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(asdict(found), indent=1) + "\n", encoding="utf-8")
    return Looked(**json.loads(file.read_text(encoding="utf-8")))


def there(asked: Asked, seed: int) -> bool:
    """Whether :func:`looked` has it already."""
    return _file(asked, seed).exists()


def _file(asked: Asked, seed: int) -> Path:
    return Path(kept("tennessee")) / f"{asked.name.replace(' ', '-')}-{seed}.json"


def _looked(plant: Plant, asked: Asked, seed: int) -> Looked:
    onset_s = plant.onset_s  # by then monitoring has its window; nothing is noticed before
    case = asked.upset.scenario(plant, seed, onset_s, onset_s + 3600.0 * HOURS, MISMATCH)
    nobody = left_alone(plant, replace(case, end_s=onset_s + 3600.0 * ALONE_HOURS)).trip
    began = time.process_time()
    try:
        done = run(plant, case, clock=DeclaredClock(THOUGHT_S))
    except ProcessError:  # far beyond its trip limits the model goes where there is no plant
        done = None
    cpu_s = time.process_time() - began
    acted = done is None or done.actor != NOBODY
    noticed_s = onset_s if done is None else done.detected_s or onset_s
    best = best_answer(plant, case, noticed_s, LEVELS, FINER) if acted else None
    return Looked(
        name=asked.name,
        told=asked.upset.told,
        hidden=asked.upset.idv in HIDDEN,
        seed=seed,
        alone_h=nobody.hours if math.isfinite(nobody.hours) else None,
        alone_limit=nobody.limit,
        **(_LOST if done is None else _said(done, onset_s) | _endured(done)),
        cpu_s=cpu_s,
        kept_by=best.admissible if best else 0,
        tried=best.points if best else 0,
        best_lost=_lost(plant, case, best, noticed_s) if best else None,
    )


def _said(done: Run, onset_s: float) -> dict[str, Any]:
    """What was noticed, called, foreseen and done, and when after ``onset_s`` [s]."""
    likeliest = next(iter(by_fault_set(done.hypotheses)), None)
    foreseen = [e.act_by_s for e in done.record.of_kind(Armed) if e.act_by_s is not None and e.act_by_s > onset_s]
    after = {
        "detected_s": done.detected_s,
        "released_s": done.released_s,
        "foreseen_s": foreseen[0] if foreseen else None,
    }
    return {
        "outcome": done.outcome.value.replace("_", " "),
        "decision_s": done.thinking_s if done.actor != NOBODY else None,
        "called": likeliest.name if likeliest else "",
        "probability": likeliest.probability if likeliest else None,
        "action": _action(done),
        **{name: None if at_s is None else at_s - onset_s for name, at_s in after.items()},
    }


def _action(done: Run) -> str:
    """What was released first, as it differs from where the plant stands by design, or the fallback that acted."""
    if not done.record.released:
        return f"fallback {done.record.fallbacks[0][1].strategy}" if done.record.fallbacks else ""
    first = done.record.released[0]
    design = dict(zip(done.plant.model.inputs, done.plant.start.tolist(), strict=True))
    variables = done.plant.description.variables
    moved = [
        c for c in first.commands if not math.isclose(c.value, design.get(variables[c.tag], math.nan), rel_tol=1e-6)
    ]
    return " ".join([f"{first.target or 'as it stands'}:", *(f"{c.tag} {c.value:.4g}" for c in moved)]).rstrip(":")


def _endured(done: Run) -> dict[str, Any]:
    """What the true plant went through."""
    margin, limit = least_margin(done.plant, done.truth, done.force)
    hard = {each.name for each in done.plant.description.limits.hard}
    return {
        "least_margin": margin,
        "least_margin_limit": limit,
        "lost": finite(done.production_loss),
        "outside_s": sum(each.total_s for each in done.exposures if each.limit in hard),
    }


def _lost(plant: Plant, case: Scenario, best: BestConstant, at_s: float) -> float | None:
    """What the ``best`` answer loses of the production where it is given at ``at_s`` [s]; None where there is none."""
    if best.setpoints is None:
        return None
    tags = plant.description.tags_by_name
    commands = tuple(Command(tag, value, tags[tag].rate_limit) for tag, value in best.setpoints.items())
    return run_steered(plant, case, new_sequencer(plant), at_s, commands).production_loss
