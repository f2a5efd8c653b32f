"""Runs of a study beside one another: processes that take one run at a time, and one that keeps what they find."""

from __future__ import annotations

import multiprocessing
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import cache
from pathlib import Path
from typing import TypeVar

from benchmarks.unknown import store
from benchmarks.unknown.jobs import Job
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.batch import use_threads

Found = TypeVar("Found")


class RunsFailed(SystemExit):
    """Some runs ended in an error; the others are in."""


@cache
def plant_named(name: str) -> Plant:
    """The plant called ``name``, loaded once per process."""
    return load_plant(name)


def each(work: Callable[[Job], Found], jobs: Sequence[Job], processes: int) -> Iterator[tuple[Job, Found]]:
    """What ``work`` finds of every one of ``jobs``, as it comes in; with one process in this one, in order.

    A run that ends in an error is told, is missing, and does not end the others; :class:`RunsFailed` after the last.
    """
    failed = 0
    for job, future in _alone(work, jobs) if processes == 1 else _beside(work, jobs, processes):
        error = future.exception()
        if isinstance(error, BrokenProcessPool):
            raise RunsFailed(f"a process was ended while {job.name} was under way; start again with fewer --jobs")
        if error is None:
            yield job, future.result()
        else:
            failed += 1
            print(f"{job.name} failed: {''.join(traceback.format_exception(error))}", flush=True)
    if failed:
        raise RunsFailed(f"{failed} of {len(jobs)} runs failed, see above; what is missing is run by the next start")


def _alone(work: Callable[[Job], Found], jobs: Sequence[Job]) -> Iterator[tuple[Job, Future[Found]]]:
    for job in jobs:
        future: Future[Found] = Future()
        try:
            future.set_result(work(job))
        except Exception as error:
            future.set_exception(error)
        yield job, future


def _beside(work: Callable[[Job], Found], jobs: Sequence[Job], processes: int) -> Iterator[tuple[Job, Future[Found]]]:
    pool = ProcessPoolExecutor(processes, multiprocessing.get_context("spawn"), _begin, (store.FOLDER,))
    try:
        asked = {pool.submit(work, job): job for job in jobs}
        for future in as_completed(asked):
            yield asked.pop(future), future
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(folder: Path) -> None:
    """What a process does first: one thread, as results must not depend on the host."""
    use_threads(1)
    store.FOLDER = folder
