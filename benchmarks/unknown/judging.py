"""Judges recorded runs: one line per look, kept on disk, so that a study goes on where it stopped."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass

from benchmarks.unknown.jobs import Job
from benchmarks.unknown.judge import Statement, Verdict, is_alike, statement, sure_of_another, verdict
from benchmarks.unknown.looks import at_looks
from benchmarks.unknown.recorder import recorded
from benchmarks.unknown.store import append, judged, lines
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


def done(fresh: bool) -> dict[tuple[str, int], Judged]:
    """Every look that was judged for the present sources, by run and time after the first symptom."""
    found = {}
    for row in lines(judged()):
        if row.pop("fresh") == fresh:
            said = tuple(statement(s) for s in row["said"])
            one = Judged(**{**row, "said": said, "violated": tuple(row["violated"])})
            found[one.run, one.after_s] = one
    return found


def judge(plant: Plant, wanted: Iterable[Job], after_s: Sequence[int], fresh: bool) -> None:
    """Look at every run of ``wanted`` that was not looked at yet, at the looks ``after_s``; all of its own for none."""
    there = done(fresh)
    for job in wanted:
        asked = [s for s in job.looks_s if not after_s or s in after_s]
        if (job.name, NO_LOOK) in there or all((job.name, s) in there for s in asked):
            continue
        for one in _looks(plant, job, asked, fresh):
            append(judged(), {**asdict(one), "fresh": fresh})
            print(told(one, job), flush=True)


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
    found, other = verdict(one.said, job.cause), sure_of_another(one.said, job.cause)
    alike = found in (Verdict.WRONG, Verdict.ELSEWHERE) and other is not None and is_alike(other, job.cause)
    return f"{found.value}, alike" if alike else found.value
