"""``homeostat campaign``: scenarios, proposers and seeds from a file, side by side, with their report."""

import argparse
import contextlib
import importlib.util
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.text import Text

from homeostat.agents.language.named_model import REPLAY, SITUATED
from homeostat.cli import operation
from homeostat.cli.arguments import UsageError
from homeostat.evaluate.report.summary import summary
from homeostat.evaluate.study.engine import measured
from homeostat.evaluate.study.measurement import KeptRuns
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.study.plan.plan import Plan, read_plan
from homeostat.evaluate.study.study import Ended, Progress, Workers, rerun_command, run_study
from homeostat.stl.spelling import near_matches

FOLDER = Path("runs")
"""Where studies are kept unless told otherwise."""
FAILED = 1
"""Exit status of a study of which some runs could not be carried out."""
PACE_S = 10.0
"""Least time between two lines of progress where nobody looks on [s]."""


def carry_out(options: argparse.Namespace) -> int:
    """Read, expand, run what is not there yet, report; 1 where a run could not be carried out."""
    plan = _with_options(read_plan(options.file), options)
    jobs = jobs_of(plan, options.file.parent, operation.chosen_model("", options))
    if options.list:
        print(*(job.name for job in jobs), sep="\n")
        return 0
    if options.only:
        return _run_again(jobs, options)
    return _run(plan, jobs, options)


def _run(plan: Plan, jobs: Sequence[Job], options: argparse.Namespace) -> int:
    folder: Path = options.out or FOLDER / options.file.stem
    # One worker per core; one where what several need is not installed.
    usual = (os.cpu_count() or 1) if importlib.util.find_spec("distributed") else 1
    workers = Workers(options.workers or usual, options.cluster)
    rerun = rerun_command(options.file, _given(options))
    try:
        with _shown(sys.stderr.isatty()) as show:
            ended = run_study(plan.title, jobs, folder, workers, show, rerun)
    except KeyboardInterrupt:
        print(f"\nstopped; the same command goes on from what is in {folder}", file=sys.stderr)
        raise
    return _conclude(ended, len(jobs))


def _conclude(ended: Ended, asked: int) -> int:
    for plant, sentences in summary(ended.rows):
        print(f"{plant}:", *(f"  {sentence}" for sentence in sentences), "", sep="\n")
    print(*(f"wrote {path}" for path in ended.files[:2]), sep="\n")
    for done in ended.failed:
        print(f"homeostat: {done.job.name} failed: {done.failure}", file=sys.stderr)
    if ended.failed:
        print(f"homeostat: {len(ended.failed)} of {asked} runs failed; start again to retry them", file=sys.stderr)
    return FAILED if ended.failed else 0


def _run_again(jobs: Sequence[Job], options: argparse.Namespace) -> int:
    """Run the jobs that are named, here, and keep each with trace and figure."""
    by_name = {job.name: job for job in jobs}
    for name in options.only:
        if name not in by_name:
            raise UsageError(f"there is no job {name!r}{near_matches(name, by_name)}; --list names all {len(by_name)}")
    folder: Path = options.out or FOLDER / "again"
    failed = 0
    for name in options.only:
        done = measured(replace(by_name[name], keep="all"), KeptRuns(folder))
        failed += done.row is None
        # what is not a run but a search for the best one is nowhere
        kept = f"in {folder / done.row.trace}" if done.row and done.row.trace else "nothing to keep"
        print(f"{name}: {done.failure if done.row is None else f'{done.row.outcome}, {kept}'}")
    return FAILED if failed else 0


def _with_options(plan: Plan, options: argparse.Namespace) -> Plan:
    """The plan with what the command line adds to it."""
    content = plan.model_dump(exclude_unset=True)
    if options.seeds is not None:
        content["seeds"] = options.seeds
        content["scenarios"] = [{**s, "seeds": None} for s in content["scenarios"]]
    known = {p.label for p in plan.proposers}
    more = [{"who": _from_here(who)} for who in dict.fromkeys(options.proposer) if who not in known]
    content["proposers"] = [*(p.model_dump(exclude_unset=True) for p in plan.proposers), *more]
    return type(plan).model_validate(content)


def _from_here(who: str) -> str:
    """A proposer of the command line: its file is looked for where the command is given, not beside the study."""
    kind = next((k for k in (REPLAY, SITUATED) if who.startswith(k)), None)
    return who if kind is None else kind + str(Path(who.removeprefix(kind)).absolute())


def _given(options: argparse.Namespace) -> list[str]:
    """The options that a rerun of one job needs as well."""
    given = [part for who in options.proposer for part in ("--proposer", who)]
    given += ["--local-only"] if options.local_only else []
    given += [part for host in options.allow_host for part in ("--allow-host", host)]
    numbers = {"--temperature": options.temperature, "--model-seed": options.model_seed, "--seeds": options.seeds}
    return [*given, *(part for name, value in numbers.items() if value is not None for part in (name, str(value)))]


@contextlib.contextmanager
def _shown(live: bool) -> Iterator[Callable[[Progress], None]]:
    """Shows progress: in one line that is written anew where somebody looks on, else in a line now and then."""
    if live:
        with Live(console=Console(stderr=True), auto_refresh=False) as line:
            yield lambda progress: line.update(Text(progress.line), refresh=True)
        return
    last = -PACE_S

    def show(progress: Progress) -> None:
        nonlocal last
        if progress.done == progress.total or time.monotonic() - last >= PACE_S:
            last = time.monotonic()
            print(progress.line, file=sys.stderr, flush=True)

    yield show
