"""Judges recorded runs: one line per look, kept on disk, so that a study goes on where it stopped."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import partial

from benchmarks.unknown.jobs import Job
from benchmarks.unknown.judge import Statement, Verdict, is_alike, statement, sure_of_another, verdict
from benchmarks.unknown.looks import at_looks
from benchmarks.unknown.recorder import recorded
from benchmarks.unknown.store import JUDGED, keep, kept
from benchmarks.unknown.workers import each, plant_named
from homeostat.plants.plant import Plant

NO_LOOK = -1
"""Look of the line that says that a run showed no symptom."""


@dataclass(frozen=True, slots=True)
class Judged:
    """One look at one run, or that there was none."""

    run: str
    """Name of the run."""
    after_s: int
    """Time since the first symptom [s]; :data:`NO_LOOK` where the run showed none."""
    at_s: float
    """Process time of the look [s]."""
    said: tuple[Statement, ...]
    """What was said."""
    cpu_s: float
    """Processor time that it took [s]."""
    noticeable: bool
    """Whether the cause is noticeable with nobody acting."""
    violated: tuple[str, ...] = ()
    """Of what is called harmless, the criteria and hard limits that the run does not satisfy."""


def done(jobs: Iterable[Job], fresh: bool) -> dict[tuple[str, int], Judged]:
    """Every look at ``jobs`` that was judged for the present sources, by run and time after the first symptom."""
    found = {}
    for _, row in kept(JUDGED, jobs):
        if row.pop("fresh") == fresh:
            one = Judged(**{**row, "said": tuple(map(statement, row["said"]))})
            found[one.run, one.after_s] = one
    return found


def judge(wanted: Sequence[Job], after_s: Sequence[int], fresh: bool, processes: int = 1) -> None:
    """Look at every run of ``wanted`` that was not looked at yet, at the looks ``after_s``; all of its own for none."""
    there = done(wanted, fresh)
    todo = [
        job
        for job in wanted
        if (job.name, NO_LOOK) not in there and any((job.name, s) not in there for s in _asked(job, after_s))
    ]
    for job, found in each(partial(_judged, after_s=tuple(after_s), fresh=fresh), todo, processes):
        for one in found:
            if (one.run, one.after_s) not in there:
                keep(JUDGED, job, {**asdict(one), "fresh": fresh})
                print(told(one, job), flush=True)


def _asked(job: Job, after_s: Sequence[int]) -> list[int]:
    return [s for s in job.looks_s if not after_s or s in after_s]


def _judged(job: Job, after_s: Sequence[int], fresh: bool) -> tuple[Judged, ...]:
    return tuple(_looks(plant_named(job.plant), job, _asked(job, after_s), fresh))


def _looks(plant: Plant, job: Job, after_s: Sequence[int], fresh: bool) -> Iterable[Judged]:
    recording, began = recorded(plant, job), time.process_time()
    noticeable, violated = bool(recording.noticed), recording.violated
    if math.isnan(recording.first_s):
        yield Judged(job.name, NO_LOOK, 0.0, (), 0.0, noticeable, violated)
        return
    seen = set()
    for after, at_s, said in at_looks(plant, job.seed, recording, after_s, fresh):
        yield Judged(job.name, after, at_s, tuple(said), time.process_time() - began, noticeable, violated)
        seen.add(after)
        began = time.process_time()
    for after in sorted(set(after_s) - seen):  # the run was over before
        yield Judged(job.name, after, math.inf, (), 0.0, noticeable, violated)


def told(one: Judged, job: Job) -> str:
    """A line for whoever waits."""
    if one.after_s == NO_LOOK or math.isinf(one.at_s):
        return f"{one.run}: {'no symptom' if one.after_s == NO_LOOK else f'+{one.after_s} s is after its end'}"
    best = sorted(one.said, key=lambda s: -s.probability)[:3]
    texts = ", ".join(f"{s.name} {s.probability:.2f}" for s in best)
    return f"{one.run} +{one.after_s} s: {words(one, job)}; {texts or 'nothing'}; {one.cpu_s:.1f} s"


def words(one: Judged, job: Job) -> str:
    """The verdict, and whether what is wrong cannot be told from the truth."""
    found, other = verdict(one.said, job.cause, one.at_s), sure_of_another(one.said, job.cause)
    alike = found in (Verdict.WRONG, Verdict.ELSEWHERE) and other is not None and is_alike(other, job.cause)
    return f"{found.value}, alike" if alike else found.value
