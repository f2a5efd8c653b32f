"""One job carried out: its row, or what failed."""

from __future__ import annotations

from dataclasses import dataclass

from homeostat.evaluate.study.measurement import Kept, measure
from homeostat.evaluate.study.plan.job import Job, code_digest
from homeostat.evaluate.study.row import Row
from homeostat.process.batch import use_threads


@dataclass(frozen=True, slots=True)
class Done:
    """One job that has ended."""

    job: Job
    """Which one."""
    row: Row | None
    """What it came to; None where it failed."""
    failure: str = ""
    """What failed, in one line; empty where nothing did."""


def measured(job: Job, kept: Kept) -> Done:
    """Carry ``job`` out on one core; a bug in one run is its failure and not the campaign's."""
    use_threads(1)
    try:
        return Done(job, measure(job, kept))
    except Exception as error:
        return failed(job, error)
    finally:
        use_threads(0)


def measured_alike(job: Job, kept: Kept, package: str) -> Done:
    """As :func:`measured`, on a worker that may be another machine; ``package``: digest of the package that asks."""
    if code_digest() != package:
        return Done(job, None, "the worker has another version of the package; install the same one everywhere")
    return measured(job, kept)


def failed(job: Job, error: BaseException) -> Done:
    """``job``, of which ``error`` came instead of a row."""
    return Done(job, None, " ".join(f"{type(error).__name__}: {error}".split()))
