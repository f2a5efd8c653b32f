"""Progress: what is done, and how long the rest takes, by a clock of the test."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.evaluate.study.engine import Done
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.study.study import Progress
from tests.evaluate.study.fake_rows import plain
from tests.evaluate.study.plans import BATCH, PUMP, jobs

JOBS = jobs(seeds=4, proposers=["do-nothing", "hindsight"], scenarios=[BATCH, PUMP])


class Clock:
    """A clock that goes when it is told."""

    def __init__(self) -> None:
        self.at_s = 1000.0

    def __call__(self) -> float:
        return self.at_s


def ended(job: Job, took_s: float) -> Done:
    return Done(job, replace(plain(), wall_s=took_s))


def test_nothing_is_known_before_anything_is_done() -> None:
    clock = Clock()
    progress = Progress(JOBS, 1, clock)
    clock.at_s += 60.0
    assert (progress.left_s, progress.line) == (None, "0 of 16 runs in 60 s")


def test_one_after_the_other() -> None:
    clock = Clock()
    progress = Progress(JOBS, 1, clock)
    for number, job in enumerate(JOBS[:4], start=1):
        clock.at_s += 10.0
        progress.take(ended(job, 10.0))
        assert progress.left_s == pytest.approx((16 - number) * 10.0)
    assert progress.line == "4 of 16 runs in 40 s, about 2 min left"


def test_runs_of_a_group_take_as_long_as_those_of_it() -> None:
    clock = Clock()
    progress = Progress(JOBS, 1, clock)
    quick = [job for job in JOBS if job.arm.who == "do-nothing" and job.label == "none"]
    slow = [job for job in JOBS if job.arm.who == "hindsight" and job.label == "none"]
    for job, took in ((quick[0], 1.0), (slow[0], 99.0)):
        clock.at_s += took
        progress.take(ended(job, took))
    others = len(JOBS) - len(quick) - len(slow)
    assert progress.left_s == pytest.approx(3 * 1.0 + 3 * 99.0 + others * 50.0)


def test_two_workers_share_the_rest() -> None:
    clock = Clock()
    progress = Progress(JOBS, 2, clock)
    for _ in range(2):
        clock.at_s += 10.0
        for job in (JOBS[progress.done], JOBS[progress.done + 1]):
            progress.take(ended(job, 10.0))
    assert progress.left_s == pytest.approx(12 * 10.0 / 2)


def test_what_is_beside_the_runs_counts() -> None:
    clock = Clock()
    progress = Progress(JOBS, 1, clock)
    clock.at_s += 15.0  # a run of 10 s, and 5 s around it
    progress.take(ended(JOBS[0], 10.0))
    assert progress.left_s == pytest.approx(15 * 15.0)


def test_failures_are_counted_and_say_nothing_about_time() -> None:
    clock = Clock()
    progress = Progress(JOBS, 1, clock)
    progress.take(Done(JOBS[0], None, "broken"))
    assert (progress.left_s, progress.failed, progress.line) == (None, 1, "1 of 16 runs in 0 s, 1 failed")
    clock.at_s += 10.0
    progress.take(ended(JOBS[1], 10.0))
    assert progress.left_s == pytest.approx(140.0)


def test_runs_that_took_no_time() -> None:
    clock = Clock()
    progress = Progress(JOBS, 4, clock)
    progress.take(ended(JOBS[0], 0.0))
    assert progress.left_s == 0.0


def test_the_end() -> None:
    clock = Clock()
    progress = Progress(JOBS, 1, clock)
    for job in JOBS:
        clock.at_s += 600.0
        progress.take(ended(job, 600.0))
    assert progress.line == "16 of 16 runs in 2.7 h"
    assert Progress((), 1, clock).line == "0 of 0 runs in 0 s"
