"""The measurement of one job: run it where it is, keep what is to be kept, and make its row."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.conditions.conditions import Conditions
from homeostat.evaluate.recorded_run import RecordedRun, record_run
from homeostat.evaluate.run import RunResult
from homeostat.evaluate.study.hindsight import hindsight_row
from homeostat.evaluate.study.plan.ablation import ABLATIONS
from homeostat.evaluate.study.plan.expansion import loaded
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.study.plan.unknown import without_faults
from homeostat.evaluate.study.row import HINDSIGHT, Row
from homeostat.evaluate.study.row_of import Observed, notable, row_of
from homeostat.journal.events import Event, Subscriber
from homeostat.record.directory import RunDirectory

RUNS = "runs"
"""Folder of the runs that are kept, in the campaign's."""


@dataclass(frozen=True, slots=True)
class Kept:
    """Where runs go that are kept."""

    root: Path | None
    """The campaign's folder; None where nothing is kept."""

    def folder(self, job: Job) -> Path | None:
        """Folder of the run of ``job``; None where it is not kept."""
        return None if self.root is None or job.keep == "none" else self.root / RUNS / job.name


def measure(job: Job, kept: Kept) -> Row:
    """Run ``job`` to its end, on one core where others work beside it; what it left from an earlier try is removed."""
    if job.arm.who == HINDSIGHT:
        return hindsight_row(job)
    folder = kept.folder(job)
    if folder is None:
        with tempfile.TemporaryDirectory() as scratch:
            return _measured(job, Path(scratch) / job.name, "")
    shutil.rmtree(folder, ignore_errors=True)
    row = _measured(job, folder, f"{RUNS}/{job.name}")
    if row.trace:
        return row
    shutil.rmtree(folder)
    return row


def _measured(job: Job, folder: Path, trace: str) -> Row:
    events: list[Event] = []

    def on_event(event: Event, at_s: float) -> None:
        events.append(event)

    def is_kept(run: RunResult) -> bool:
        return bool(trace) and (job.keep == "all" or notable(job, run))

    with RunDirectory(folder) as directory:
        done = _recorded(job, directory, on_event, is_kept)
        if directory.missing:
            raise OSError(f"the record in {str(directory.path)!r} is incomplete: {directory.missing}")
    observed = Observed(done.run, done.result.steps, tuple(events))
    return row_of(job, observed, trace if is_kept(done.run) else "")


def _recorded(
    job: Job, directory: RunDirectory, on_event: Subscriber, is_kept: Callable[[RunResult], bool]
) -> RecordedRun:
    case, ablation, arm = loaded(job.scenario.case), ABLATIONS[job.ablation], job.arm
    known = without_faults(case, [f.fault for f in job.scenario.faults]) if job.kind == "unknown" else case
    conditions = Conditions(
        arm.protocol, arm.label_given or ablation.label_given, ablation.reprompting, ablation.ensemble
    )
    return record_run(
        case, job.scenario, directory, job.thinking, arm.who, on_event, _unwatched,
        arm.language(ablation.grounding), conditions, arm.propose, known, is_kept,
    )  # fmt: skip


def _unwatched(snapshot: Snapshot) -> None:
    """Nobody looks on."""
