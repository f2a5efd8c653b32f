"""A wrong label forced on recovery: does a release violate a limit, and does the guard catch it?"""

from __future__ import annotations

import time
from dataclasses import dataclass

from benchmarks.unknown.jobs import Job, scenario_of
from benchmarks.unknown.operated import THINKING_S
from benchmarks.unknown.workers import plant_named
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.reference.unsupervised import unsupervised
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.score.scoring import inside_at_end, kept_until, outside_after
from homeostat.links.clock import DeclaredClock
from homeostat.process.batch import ProcessError


@dataclass(frozen=True, slots=True)
class Forced:
    """One run in which recovery is told that a fault is another one."""

    run: str
    """Name of the run."""
    releases: int
    """How often something was released."""
    outside: tuple[str, ...]
    """Hard limits that the true plant is outside of after the first release, but for what then comes back at once."""
    outside_s: float
    """Longest time outside one of them after it [s]."""
    alone_s: float
    """The longest time outside one of them after it of the same plant that is left alone [s]; infinite where that
    leaves the physical world."""
    caught: bool
    """Whether the guard fell back after the first release, and the plant ends inside its hard limits."""
    outcome: str
    """How it ended."""
    cpu_s: float
    """Processor time [s]."""

    @property
    def missed(self) -> bool:
        """Whether a release violates a limit, and the guard does not catch it."""
        return bool(self.outside) and not self.caught


def forced(job: Job) -> Forced:
    """Run ``job`` with everything on but the diagnosis: recovery is told the job's label, and nothing else."""
    plant, began = plant_named(job.plant), time.process_time()
    assert job.cause.told is not None, f"{job.name} has no label"
    proposing = Proposing(conditions=Conditions(label_given=True, label=(job.cause.told,)))
    done = run(plant, scenario_of(plant, job), clock=DeclaredClock(THINKING_S), proposing=proposing)
    cpu_s = time.process_time() - began
    released_s = done.released_s
    after = {} if released_s is None else outside_after(done.truth, done.force, released_s)
    if released_s is None or kept_until(after, done.truth, done.force.settled_s(released_s)) is not None:
        after = {}
    return Forced(
        job.name,
        len(done.record.released),
        tuple(after),
        max((times.size * done.truth.dt_s for times in after.values()), default=0.0),
        _alone_s(done, released_s) if after and released_s is not None else 0.0,
        _caught(done),
        done.outcome.value,
        cpu_s,
    )


def _caught(done: Run) -> bool:
    """Whether the guard fell back after the first release, and the plant ends inside its hard limits."""
    released_s = done.released_s
    fell_back = released_s is not None and any(at_s >= released_s for at_s, _ in done.record.fallbacks)
    return fell_back and inside_at_end(done.truth, done.force)


def _alone_s(done: Run, from_s: float) -> float:
    """Longest time outside one hard limit after ``from_s`` of the same plant with nobody acting [s]."""
    try:
        truth = unsupervised(done.plant, done.scenario).truth
    except ProcessError:
        return float("inf")
    outside = outside_after(truth, done.force, from_s)
    return max((times.size * truth.dt_s for times in outside.values()), default=0.0)
