"""Engines: where jobs are carried out. In this process, on several processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from homeostat.campaign.study.error import CampaignError
from homeostat.campaign.study.job import Job, code_digest
from homeostat.campaign.study.measurement import Kept, measure
from homeostat.campaign.study.row import Row
from homeostat.process.batch import use_threads

WAIT_S = 30
"""How long a cluster's scheduler is waited for [s]."""
DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
"""What workers of this machine do first: Ctrl-C is for the campaign, which closes them."""
_MIB = 1 << 20
LEAN = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": {
        "OPENBLAS_NUM_THREADS": 1, "OMP_NUM_THREADS": 1, "MKL_NUM_THREADS": 1,
        "MALLOC_ARENA_MAX": 1, "MALLOC_TRIM_THRESHOLD_": 256 * _MIB, "MALLOC_MMAP_THRESHOLD_": 32 * _MIB,
    },
}  # fmt: skip
"""Settings of Dask for workers of this machine.

Its profiler stops a worker a hundred times a second, and its setting of the C library gives freed memory back at once:
together a fifth of the time of a run here, which allocates the same arrays again and again in one thread.
"""


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
        return _failed(job, error)
    finally:
        use_threads(0)


def measured_alike(job: Job, kept: Kept, package: str) -> Done:
    """As :func:`measured`, on a worker that may be another machine; ``package``: digest of the package that asks."""
    if code_digest() != package:
        return Done(job, None, "the worker has another version of the package; install the same one everywhere")
    return measured(job, kept)


def _pair(job: Job) -> tuple[str, str, int]:
    """Jobs of one plant with the same faults: one worker does best to have them, as they share what it worked out."""
    return job.scenario.case, job.label, job.scenario.seed


def _failed(job: Job, error: BaseException) -> Done:
    return Done(job, None, " ".join(f"{type(error).__name__}: {error}".split()))


def carry_out(jobs: Sequence[Job], kept: Kept, workers: int, cluster: str | None = None) -> Iterator[Done]:
    """Every job as it ends; one after the other in this process for one worker, in any order otherwise.

    ``cluster``: address of a Dask scheduler whose workers have this package and see the campaign's folder. Raises
    CampaignError where it does not answer any more, or where what several workers need is not installed.
    """
    if workers == 1 and cluster is None:
        yield from (measured(job, kept) for job in jobs)
        return
    try:
        import distributed
    except ImportError as error:
        raise CampaignError(
            f"several workers need {error.name!r}: pip install 'homeostat[campaign]', or use --workers 1"
        ) from error
    with ExitStack() as stack:
        yield from _distributed(distributed, stack, jobs, kept, workers, cluster)


def _client(dask: Any, address: str) -> Any:
    """A client of the scheduler at ``address``; CampaignError where none answers in time.

    Whoever listens there and says nothing is waited for without end by the library itself, so this waits beside it.
    """
    answer: SimpleQueue[Any] = SimpleQueue()

    def connect() -> None:
        try:
            answer.put(dask.Client(address, timeout=WAIT_S))
        except BaseException as error:  # whatever it is, it is told where somebody waits, or to nobody
            answer.put(error)

    threading.Thread(target=connect, daemon=True).start()
    try:
        found = answer.get(timeout=2 * WAIT_S)
    except Empty:
        found = TimeoutError("it listens and does not speak")
    if isinstance(found, BaseException):
        raise CampaignError(f"no scheduler answers at {address!r} ({found}); start one with 'dask scheduler'")
    return found


def _local(dask: Any, workers: int) -> Any:
    """A cluster of ``workers`` processes of this machine."""
    from dask import config

    with config.set(LEAN):
        return dask.LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, silence_logs=logging.CRITICAL,
            scheduler_kwargs={"dashboard": False, "dashboard_address": ":0"}, preload=DEAF,
        )  # fmt: skip


def _distributed(
    dask: Any, stack: ExitStack, jobs: Sequence[Job], kept: Kept, workers: int, cluster: str | None
) -> Iterator[Done]:
    """The same on a cluster; a job whose worker died is given to another one by its scheduler."""
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # whatever matters comes as an exception
    if cluster is None:
        client = stack.enter_context(dask.Client(stack.enter_context(_local(dask, min(workers, len(jobs))))))
    else:
        client = stack.enter_context(_client(dask, cluster))
    by_key = {f"{job.name}-{job.fingerprint}": job for job in jobs}
    package = code_digest()
    homes = sorted(client.scheduler_info(n_workers=-1)["workers"])
    numbers = {pair: n for n, pair in enumerate(dict.fromkeys(map(_pair, by_key.values())))}
    futures = [
        client.submit(
            measured_alike, job, kept, package, key=key, pure=False, allow_other_workers=True,
            workers=[homes[numbers[_pair(job)] % len(homes)]] if homes else None,
        )
        for key, job in by_key.items()
    ]  # fmt: skip
    for future in dask.as_completed(futures):
        if future.cancelled():
            raise CampaignError("the scheduler was lost; start it and the same command again, which goes on from here")
        broke = future.exception()
        yield _failed(by_key[future.key], broke) if broke else future.result()
        future.release()
