"""Jobs on a Dask cluster: one of this machine, made for a study, or one that runs somewhere."""

import logging
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

import distributed
from dask import config

from homeostat.evaluate.study.engine import Done, failed, measured_alike
from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.measurement import KeptRuns
from homeostat.evaluate.study.plan.job import Job, code_digest

T = TypeVar("T")
_dask: Any = distributed  # its types are there in part only
WAIT_S = 30
"""How long a scheduler, and its first worker, are waited for [s]."""
DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"
"""What workers of this machine do first: Ctrl-C is for the study, which closes them."""
_MIB = 1 << 20
_ONE = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "MALLOC_ARENA_MAX")
_FREED = {"MALLOC_TRIM_THRESHOLD_": 256 * _MIB, "MALLOC_MMAP_THRESHOLD_": 32 * _MIB}
LEAN = {
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": {**dict.fromkeys(_ONE, 1), **_FREED},
}
"""Settings of Dask for workers of this machine.

Its profiler stops a worker a hundred times a second, and its setting of the C library gives freed memory back at once:
together a sixth of the time of a run here, which allocates the same arrays again and again in one thread.
"""


def on_this_machine(stack: ExitStack, workers: int) -> Any:
    """A client of a new cluster of ``workers`` processes of this machine, which ``stack`` closes."""
    _quiet()
    alone = {"dashboard": False, "dashboard_address": ":0"}
    how = {"processes": True, "silence_logs": logging.CRITICAL, "scheduler_kwargs": alone, "preload": DEAF}
    with config.set(LEAN):
        cluster = _dask.LocalCluster(n_workers=workers, threads_per_worker=1, **how)
    return stack.enter_context(_dask.Client(stack.enter_context(cluster)))


def at_address(stack: ExitStack, address: str) -> Any:
    """A client of the scheduler at ``address``; StudyError where none answers in time, or has no worker.

    Whoever listens there and says nothing is waited for without end by the library itself, so this waits beside it.
    """
    _quiet()
    answer: SimpleQueue[Any] = SimpleQueue()

    def connect() -> None:
        try:
            answer.put(_dask.Client(address, timeout=WAIT_S))
        except BaseException as error:  # whatever it is, it is told where somebody waits, or to nobody
            answer.put(error)

    threading.Thread(target=connect, daemon=True).start()
    try:
        found = answer.get(timeout=2 * WAIT_S)
    except Empty:
        found = TimeoutError("it listens and does not speak")
    if isinstance(found, BaseException):
        raise StudyError(f"no scheduler answers at {address!r} ({found}); start one with 'dask scheduler'")
    client = stack.enter_context(found)
    try:
        client.wait_for_workers(1, timeout=WAIT_S)
    except OSError as error:
        raise StudyError(
            f"the scheduler at {address!r} has no worker; start one with 'dask worker {address}'"
        ) from error
    return client


def carry_out_on(client: Any, jobs: Sequence[Job], kept: KeptRuns) -> Iterator[Done]:
    """Every job as it ends; a job whose worker died is given to another one by the scheduler, as are those that wait.

    No job is tied to a worker, though runs of one plant share what a worker worked out: that is worth one percent, and
    a worker that comes back under another address would be waited for without end. Raises StudyError where the
    scheduler is lost.
    """
    by_key = {f"{job.name}-{job.fingerprint}": job for job in jobs}
    package = code_digest()
    for key, found in results(client, measured_alike, {key: (job, kept, package) for key, job in by_key.items()}):
        yield failed(by_key[key], found) if isinstance(found, BaseException) else found


def results(
    client: Any, work: Callable[..., T], tasks: Mapping[str, tuple[Any, ...]]
) -> Iterator[tuple[str, T | BaseException]]:
    """What ``work`` gives for every task, each after its key, as it ends; what it raises stands for what it gives.

    Raises StudyError where the scheduler is lost.
    """
    futures = [client.submit(work, *given, key=key, pure=False) for key, given in tasks.items()]
    for future in _dask.as_completed(futures):
        if future.cancelled():
            raise StudyError("the scheduler was lost; start it and the same command again, which goes on from here")
        yield future.key, future.exception() or future.result()
        future.release()


def _quiet() -> None:
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # whatever matters comes as an exception
