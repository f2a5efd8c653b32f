"""Two known faults at once, with everything on: is a hard limit violated that something else would have kept?"""

from __future__ import annotations

import time
from dataclasses import dataclass

from benchmarks.unknown.jobs import Job, scenario_of
from benchmarks.unknown.operated import THINKING_S
from benchmarks.unknown.strategies import NONE, kept_by
from benchmarks.unknown.workers import plant_named
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.score.scoring import outside_after
from homeostat.links.clock import DeclaredClock


@dataclass(frozen=True, slots=True)
class Paired:
    """One run with two faults."""

    run: str
    """Name of the run."""
    noticed: bool
    """Whether anything was seen: a symptom that was reported, or a trip."""
    outside: tuple[str, ...]
    """Hard limits that it is outside of after that; after the first onset where nothing was seen."""
    kept_by: str
    """The first strategy that keeps one of them; empty where none that was tried does."""
    outcome: str
    """How it ended."""
    cpu_s: float
    """Processor time of the run with everything on [s]."""
    tried_cpu_s: float
    """Processor time of the strategies [s]."""

    @property
    def avoidable(self) -> bool:
        """Whether it is outside after it was noticed, and something else is not."""
        return self.noticed and self.kept_by != NONE


def paired(job: Job) -> Paired:
    """Run ``job`` with everything on and, where it is outside a hard limit, by what else could have been done."""
    plant, began = plant_named(job.plant), time.process_time()
    done = run(plant, scenario_of(plant, job), clock=DeclaredClock(THINKING_S))
    ran_s = time.process_time()
    noticed_s = first_seen_s(done)
    from_s = _onset_s(done) if noticed_s is None else noticed_s
    outside = outside_after(done.truth, done.force, from_s)
    by = kept_by(done, outside, from_s) if outside else NONE
    return Paired(
        job.name,
        noticed_s is not None,
        tuple(outside),
        by,
        done.outcome.value,
        ran_s - began,
        time.process_time() - ran_s,
    )


def first_seen_s(done: Run) -> float | None:
    """Process time of the first symptom that was reported, or of a trip, from the onset on [s]; None for neither."""
    symptoms = (s.at_s for _, event in done.record.diagnosed for s in event.symptoms)
    seen = [*symptoms, *(at_s for at_s, _ in done.record.diagnosed), *done.record.tripped_s]
    return min((at_s for at_s in seen if at_s >= _onset_s(done)), default=None)


def _onset_s(done: Run) -> float:
    return done.scenario.onset_s or 0.0
