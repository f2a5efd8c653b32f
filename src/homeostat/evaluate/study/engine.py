"""Engines: where jobs are carried out. In this process, on several processes of this machine, or on a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack

from homeostat.evaluate.study.done import Done, measured
from homeostat.evaluate.study.error import CampaignError
from homeostat.evaluate.study.measurement import Kept
from homeostat.evaluate.study.plan.job import Job


def carry_out(jobs: Sequence[Job], kept: Kept, workers: int, cluster: str | None = None) -> Iterator[Done]:
    """Every job as it ends; one after the other in this process for one worker, in any order otherwise.

    ``cluster``: address of a Dask scheduler whose workers have this package and see the campaign's folder. Raises
    CampaignError where it does not answer any more, or where what several workers need is not installed.
    """
    if workers == 1 and cluster is None:
        yield from (measured(job, kept) for job in jobs)
        return
    try:
        from homeostat.evaluate.study.cluster import at_address, carry_out_on, on_this_machine
    except ImportError as error:
        raise CampaignError(
            f"several workers need {error.name!r}: pip install 'homeostat[campaign]', or use --workers 1"
        ) from error
    with ExitStack() as stack:
        client = on_this_machine(stack, min(workers, len(jobs))) if cluster is None else at_address(stack, cluster)
        yield from carry_out_on(client, jobs, kept)
