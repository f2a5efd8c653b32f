"""Engines: where jobs are carried out, here, on several processes or on a Dask cluster, and what came of each."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.measurement import KeptRuns, measure
from homeostat.evaluate.study.plan.job import Job, code_digest
from homeostat.process.batch import use_threads
from homeostat.record.row import Row


@dataclass(frozen=True, slots=True)
class Done:
    """One job that has ended."""

    job: Job
    """Which one."""
    row: Row | None
    """What it came to; None where it failed."""
    failure: str = ""
    """What failed, in one line; empty where nothing did."""


def measured(job: Job, kept: KeptRuns) -> Done:
    """Carry ``job`` out on one core; a bug in one run is its failure and not the study's."""
    use_threads(1)
    try:
        return Done(job, measure(job, kept))
    except Exception as error:
        return failed(job, error)
    finally:
        use_threads(0)


def measured_alike(job: Job, kept: KeptRuns, package: str) -> Done:
    """As :func:`measured`, on a worker that may be another machine; ``package``: digest of the package that asks."""
    if code_digest() != package:
        return Done(job, None, "the worker has another version of the package; install the same one everywhere")
    return measured(job, kept)


def failed(job: Job, error: BaseException) -> Done:
    """``job``, of which ``error`` came instead of a row."""
    return Done(job, None, " ".join(f"{type(error).__name__}: {error}".split()))


def carry_out(jobs: Sequence[Job], kept: KeptRuns, workers: int, cluster: str | None = None) -> Iterator[Done]:
    """Every job as it ends; one after the other in this process for one worker, in any order otherwise.

    ``cluster``: address of a Dask scheduler whose workers have this package and see the study's folder. Raises
    StudyError where it does not answer any more, or where what several workers need is not installed.
    """
    if workers == 1 and cluster is None:
        yield from (measured(job, kept) for job in jobs)
        return
    try:
        from homeostat.evaluate.study.cluster import at_address, carry_out_on, on_this_machine
    except ImportError as error:
        raise StudyError(
            f"several workers need {error.name!r}: pip install 'homeostat[campaign]', or use --workers 1"
        ) from error
    with ExitStack() as stack:
        client = on_this_machine(stack, min(workers, len(jobs))) if cluster is None else at_address(stack, cluster)
        yield from carry_out_on(client, jobs, kept)
