"""A wrong label forced on recovery: does a release violate a limit, and does the guard catch it?"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.unknown.jobs import Job, scenario_of
from benchmarks.unknown.operated import THINKING_S
from benchmarks.unknown.workers import plant_named
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.reference.unsupervised import unsupervised
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.score.scoring import RETURN_S, inside_at_end, kept_until, outside_after
from homeostat.links.clock import DeclaredClock
from homeostat.process.batch import ProcessError

AT_ONCE_S = 10.0
"""Longest from when a limit is left until the guard falls back [s]."""
NO_LONGER_S = 10.0
"""By how much longer it may be outside than if nobody had acted [s]."""


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
    """Whether the guard fell back in time, and the plant ends inside its hard limits; see :func:`is_caught`."""
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
    outside_s = max((times.size * done.truth.dt_s for times in after.values()), default=0.0)
    alone_s = _alone_s(done, released_s) if after and released_s is not None else 0.0
    fallen_s = [at_s for at_s, _ in done.record.fallbacks if released_s is not None and at_s >= released_s]
    from_s = min((float(times[0]) for times in after.values()), default=math.inf)
    back = inside_at_end(done.truth, done.force)
    return Forced(
        job.name,
        len(done.record.released),
        tuple(after),
        outside_s,
        alone_s,
        bool(after) and back and is_caught(fallen_s, from_s, outside_s, alone_s),
        done.outcome.value,
        cpu_s,
    )


def is_caught(fallen_s: Sequence[float], from_s: float, outside_s: float, alone_s: float) -> bool:
    """Whether the guard catches a release after which a limit is left ``from_s`` on [s].

    It falls back, at ``fallen_s``, before that or at once; the plant is outside for ``outside_s``, not much longer
    than if nobody had acted, or no longer than a fallback takes [s].
    """
    in_time = bool(fallen_s) and min(fallen_s) <= from_s + AT_ONCE_S
    return in_time and outside_s <= max(alone_s + NO_LONGER_S, RETURN_S)


def _alone_s(done: Run, from_s: float) -> float:
    """Longest time outside one hard limit after ``from_s`` of the same plant with nobody acting [s]."""
    try:
        truth = unsupervised(done.plant, done.scenario).truth
    except ProcessError:
        return math.inf
    outside = outside_after(truth, done.force, from_s)
    return max((times.size * truth.dt_s for times in outside.values()), default=0.0)
