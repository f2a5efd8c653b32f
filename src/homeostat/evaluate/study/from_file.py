"""A study as a caller from Python wants it: a file, and what came of it."""

from __future__ import annotations

from pathlib import Path

from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.file import read_plan
from homeostat.evaluate.study.study import Ended, Workers, rerun_command, run_campaign


class Study:
    """Many runs, described by one file: scenarios, proposers, seeds."""

    def __init__(self, file: Path | str) -> None:
        """Read ``file`` and find its jobs; CampaignError with place, value and remedy where that cannot be done."""
        self._file = Path(file)
        plan = read_plan(self._file)
        self.title = plan.title
        """What the file calls it."""
        self.jobs = jobs_of(plan, self._file.parent)
        """Every run that it asks for, in the order of the file."""

    def run(self, folder: Path | str, workers: int = 1) -> Ended:
        """Run what ``folder`` does not hold yet, and write dataset and report; the same call goes on after a stop.

        ``workers``: processes on this machine. Raises CampaignError where ``folder`` is in use, workers cannot be had,
        or what the report needs is not installed.
        """
        return run_campaign(
            self.title, self.jobs, Path(folder), Workers(workers), lambda progress: None, rerun_command(self._file)
        )
