"""A study from its jobs to its folder: ledger, dataset, provenance and report; and its progress meanwhile."""

import importlib.util
import json
import shlex
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from homeostat import __version__
from homeostat.evaluate.recorded.run import LIBRARIES
from homeostat.evaluate.report.report import Rerun, Unmade, write_report
from homeostat.evaluate.study.engine import Done, carry_out
from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.ledger import DATASET, Ledger, in_order, write_dataset
from homeostat.evaluate.study.measurement import KeptRuns
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.job import Job, code_digest
from homeostat.evaluate.study.plan.plan import read_plan
from homeostat.journal.beside.files import write_whole
from homeostat.record.row import Row

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
        longer as the study took in all beyond its runs.
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


REPORT_NEEDS = ("jinja2", "scipy")
"""Libraries of the extra ``campaign`` without which there is no report."""
PROVENANCE = "provenance.json"
"""Name of the file that says what the rows were made from."""


@dataclass(frozen=True, slots=True)
class Workers:
    """Who carries the jobs out."""

    number: int
    """Processes on this machine; 1 for this one alone."""
    cluster: str | None = None
    """Address of a Dask scheduler; None for this machine."""


@dataclass(frozen=True, slots=True)
class Ended:
    """What a study came to."""

    rows: tuple[Row, ...]
    """Every row, in the order of the jobs."""
    failed: tuple[Done, ...]
    """Jobs that failed; the next start tries them again."""
    files: tuple[Path, ...]
    """What was written: dataset, report, tables."""


def run_study(
    title: str, jobs: Sequence[Job], folder: Path, workers: Workers, show: Callable[[Progress], None], rerun: Rerun
) -> Ended:
    """Carry out the jobs that ``folder`` does not hold yet, and write dataset and report of all of them.

    ``show`` is told of every job that ends; ``rerun`` gives the command that repeats a row. Whatever stops this, every
    row that was shown is in ``folder``, and the same call goes on from there. Raises StudyError where ``folder`` is
    in use, workers cannot be had, or what the report needs is not installed.
    """
    for name in REPORT_NEEDS:
        if importlib.util.find_spec(name) is None:
            raise StudyError(f"the report of a study needs {name!r}: pip install 'homeostat[campaign]'")
    prints = {job.fingerprint: job for job in jobs}
    by_name = {job.name: fingerprint for fingerprint, job in prints.items()}
    failed: list[Done] = []
    with Ledger(folder) as ledger:
        todo = [job for fingerprint, job in prints.items() if fingerprint not in ledger.rows]
        made_from = _provenance(title, jobs, _other_versions(folder / PROVENANCE) if len(todo) < len(prints) else [])
        progress = Progress(todo, workers.number)
        show(progress)
        for ended in carry_out(todo, KeptRuns(folder.resolve()), workers.number, workers.cluster) if todo else ():
            done = _as_planned(ended, by_name[ended.job.name])
            if done.row is None:
                failed.append(done)
            else:
                if progress.done == progress.failed:  # the first row: whoever goes on after a death must know
                    write_whole(folder / PROVENANCE, made_from)
                ledger.add(by_name[done.job.name], done.row)
            progress.take(done)
            show(progress)
        rows = in_order(prints, ledger)
        write_dataset(folder / DATASET, rows)
        write_whole(folder / PROVENANCE, made_from)
        unmade = [Unmade(done.job.name, done.failure) for done in failed]
        files = write_report(folder, title, rows, rerun, None, unmade)
    return Ended(tuple(rows), tuple(failed), (folder / DATASET, *files))


def _as_planned(done: Done, fingerprint: str) -> Done:
    """``done``; failed where its recorded answers are not those any more that gave its job this ``fingerprint``."""
    if done.row is None:
        return done
    try:
        if done.job.fingerprint == fingerprint:
            return done
        why = "they were changed since the study began"
    except OSError as error:
        why = f"they cannot be read any more ({error.strerror})"
    return Done(done.job, None, f"of what answers it was made is not known: {why}; start the study again")


def rerun_command(source: Path, options: Sequence[str] = ()) -> Rerun:
    """What gives the command that repeats a row of the study in ``source``, started with ``options``."""
    begin = shlex.join(["homeostat", "campaign", str(source), *options, "--only"])
    return lambda row: f"{begin} {shlex.quote(row.job)}"


def _provenance(title: str, jobs: Sequence[Job], earlier: Sequence[object]) -> bytes:
    """What the rows were made from; ``earlier``: versions of libraries that some of them were made with before."""
    own = {job.scenario.case: asdict(job.own) for job in jobs if job.own is not None}
    content = {"title": title, "package": code_digest(), "own_plants": own, "versions": _versions()}
    return (json.dumps(content | ({"earlier_versions": earlier} if earlier else {}), indent=1) + "\n").encode()


def _versions() -> dict[str, str]:
    return {"homeostat": __version__, "python": sys.version.split()[0], **{n: version(n) for n in LIBRARIES}}


def _other_versions(path: Path) -> list[object]:
    """Versions that the provenance in ``path`` has and that are not those of now: rows of both may stand in a study."""
    try:
        content = json.loads(path.read_bytes())
        had = [*content.get("earlier_versions", []), content["versions"]]
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return []  # the study has not come so far before, or somebody else wrote it
    return [each for k, each in enumerate(had) if each != _versions() and each not in had[:k]]


class Study:
    """Many runs, described by one file: scenarios, proposers, seeds."""

    def __init__(self, file: Path | str) -> None:
        """Read ``file`` and find its jobs; StudyError with place, value and remedy where that cannot be done.

        TypeError where ``file`` is no path.
        """
        if not isinstance(file, str | Path):
            raise TypeError(f"file {file!r} must be a path, as 'campaigns/quick.toml'")
        self._file = Path(file)
        plan = read_plan(self._file)
        self.title = plan.title
        """What the file calls it."""
        self.jobs = jobs_of(plan, self._file.parent)
        """Every run that it asks for, in the order of the file."""

    def run(self, folder: Path | str, workers: int = 1) -> Ended:
        """Run what ``folder`` does not hold yet, and write dataset and report; the same call goes on after a stop.

        ``workers``: processes on this machine. Raises StudyError where ``folder`` is in use, workers cannot be had,
        or what the report needs is not installed.
        """
        return run_study(
            self.title, self.jobs, Path(folder), Workers(workers), lambda progress: None, rerun_command(self._file)
        )
