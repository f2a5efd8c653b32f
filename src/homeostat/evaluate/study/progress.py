"""The progress of a campaign: what is done, and about how long the rest will take."""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence

from homeostat.evaluate.study.engine import Done
from homeostat.evaluate.study.plan.job import Job

Group = tuple[str, str, str, str]
"""Plant, scenario, proposer and ablation: runs of one group take about the same time."""


class Progress:
    """Follows jobs as they end."""

    def __init__(self, jobs: Sequence[Job], workers: int, now: Callable[[], float] = time.monotonic) -> None:
        """``jobs`` are still to be done; ``workers`` share them."""
        self.total, self.done, self.failed = len(jobs), 0, 0
        self._left: dict[Group, int] = defaultdict(int)
        for job in jobs:
            self._left[_group(job)] += 1
        self._took: dict[Group, list[float]] = defaultdict(list)
        self._workers, self._now, self._began = workers, now, now()

    def take(self, done: Done) -> None:
        """One more has ended."""
        self.done += 1
        self.failed += done.row is None
        group = _group(done.job)
        self._left[group] -= 1
        if done.row is not None:
            self._took[group].append(done.row.wall_s)

    @property
    def elapsed_s(self) -> float:
        """Since the start [s]."""
        return self._now() - self._began

    @property
    def left_s(self) -> float | None:
        """About how long the rest takes [s]; None before anything is done.

        Runs of a group take as long as those of it that have ended, others as long as all on average; and both as much
        longer as the campaign took in all beyond its runs.
        """
        times = [t for group in self._took.values() for t in group]
        if not times:
            return None
        usual = sum(times) / len(times)
        rest = sum(n * (sum(t) / len(t) if (t := self._took.get(g)) else usual) for g, n in self._left.items())
        return rest * self.elapsed_s / sum(times) if sum(times) > 0.0 else rest / self._workers

    @property
    def line(self) -> str:
        """One line for a terminal."""
        left = self.left_s
        rest = "" if left is None or self.done == self.total else f", about {_words(left)} left"
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.done} of {self.total} runs in {_words(self.elapsed_s)}{rest}{failed}"


def _group(job: Job) -> Group:
    return job.scenario.case, job.label, job.arm.label, job.ablation


def _words(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
