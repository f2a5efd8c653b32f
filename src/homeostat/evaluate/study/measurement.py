"""The measurement of one job: run it where it is, keep what is to be kept, and make its row."""

import shutil
import tempfile
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path

from pyoxigraph import RdfFormat

from homeostat.evaluate.beginning import watched
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.recorded.run import record_run
from homeostat.evaluate.run import Run
from homeostat.evaluate.study.hindsight import hindsight_row
from homeostat.evaluate.study.plan.job import ABLATIONS, Job
from homeostat.evaluate.study.plan.plants import plant_of
from homeostat.evaluate.study.row_of import notable, row_of
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.plants.plant import Plant
from homeostat.record.directory import RunDirectory, clear
from homeostat.record.row import HINDSIGHT, Row

RUNS = "runs"
"""Folder of the runs that are kept, in the study's."""


@dataclass(frozen=True, slots=True)
class KeptRuns:
    """Where runs go that are kept."""

    root: Path | None
    """The study's folder; None where nothing is kept."""

    def folder(self, job: Job) -> Path | None:
        """Folder of the run of ``job``; None where it is not kept."""
        return None if self.root is None or job.keep == "none" else self.root / RUNS / job.name


def measure(job: Job, kept: KeptRuns) -> Row:
    """Run ``job`` to its end, on one core where others work beside it; what it left from an earlier try is removed.

    RunDirectoryError where that still goes on, as on a worker that was given up and lives.
    """
    if job.arm.who == HINDSIGHT:
        return hindsight_row(job)
    folder = kept.folder(job)
    if folder is None:
        with tempfile.TemporaryDirectory() as scratch:
            return _measured(job, Path(scratch) / job.name, "")
    clear(folder)
    row = _measured(job, folder, f"{RUNS}/{job.name}")
    if row.trace:
        return row
    shutil.rmtree(folder)
    return row


def _measured(job: Job, folder: Path, trace: str) -> Row:
    def is_kept(run: Run) -> bool:
        return bool(trace) and (job.keep == "all" or notable(job, run))

    with RunDirectory(folder) as directory:
        done = _recorded(job, directory, is_kept)
        if directory.missing:
            raise OSError(f"the record in {str(directory.path)!r} is incomplete: {directory.missing}")
    return row_of(job, done, trace if is_kept(done) else "")


def _recorded(job: Job, directory: RunDirectory, is_kept: Callable[[Run], bool]) -> Run:
    plant, ablation, arm = watched(plant_of(job), job.scenario), ABLATIONS[job.ablation], job.arm
    known = without_faults(plant, [f.fault for f in job.scenario.faults]) if job.kind == "unknown" else plant
    conditions = Conditions(
        arm.protocol, arm.label_given or ablation.label_given, ablation.reprompting, ablation.ensemble
    )
    return record_run(
        plant,
        job.scenario,
        directory,
        job.thinking,
        arm.who,
        proposing=Proposing(arm.language(ablation.grounding), conditions, arm.propose, known),
        kept=is_kept,
    )


def without_faults(plant: Plant, names: Collection[str]) -> Plant:
    """What agents know of ``plant`` where nobody thought of the faults called ``names``: no cause, no symptom of it.

    Symptoms that indicate other faults as well go on indicating those; the rest are watched and explain nothing.
    """
    graph = EmbeddedStore()
    graph.load(plant.graph.dump(RdfFormat.TURTLE), RdfFormat.TURTLE)
    for name in names:
        fault = f"<{plant.namespace}fault_{name}>"
        graph.update(f"DELETE WHERE {{ {fault} ?p ?o }}")
        graph.update(f"DELETE WHERE {{ ?s ?p {fault} }}")
    d = plant.description
    rules = tuple(replace(r, faults=tuple(f for f in r.faults if f not in names)) for r in d.symptom_rules)
    description = replace(d, faults=tuple(f for f in d.faults if f.name not in names), symptom_rules=rules)
    return replace(plant, graph=graph, description=description)
