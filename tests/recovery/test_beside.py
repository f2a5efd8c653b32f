"""Work beside the loop: it keeps nobody, and what never ends takes no more than its share of the machine."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from typing import Any

import pytest

from homeostat.recovery.beside import MOST, DaemonExecutor, start

WAIT_S = 5.0


def test_what_is_computed_or_raised_belongs_to_whoever_waits() -> None:
    executor = DaemonExecutor()
    for begin in (start, executor.submit):
        assert begin(divmod, 7, 2).result(WAIT_S) == (3, 1)
        with pytest.raises(ZeroDivisionError):
            begin(divmod, 7, 0).result(WAIT_S)


def test_what_never_ends_takes_a_few_threads_and_no_more_however_often_it_is_begun() -> None:
    executor, release = DaemonExecutor(), threading.Event()
    begun: list[int] = []
    hang: list[Future[Any]] = []
    try:
        for number in range(20):
            running = threading.Event()

            def work(number: int = number, running: threading.Event = running) -> None:
                begun.append(number)
                running.set()
                release.wait()

            hang.append(executor.submit(work))
            if number < MOST:
                assert running.wait(WAIT_S)
            hang[-1].cancel()  # what runs already cannot be cancelled, and is given up
        assert begun == list(range(MOST))
        assert [f.cancelled() for f in hang] == [False] * MOST + [True] * (20 - MOST)
        asked = executor.submit(sum, (1, 2))
        assert not asked.done()
    finally:
        release.set()
    assert asked.result(WAIT_S) == 3, "it is done as soon as a thread is free"


def test_what_waits_is_done_in_its_turn_and_by_no_more_threads() -> None:
    executor, release = DaemonExecutor(), threading.Event()
    done: list[tuple[int, str]] = []
    for _ in range(MOST):
        executor.submit(release.wait)

    def work(number: int) -> None:
        done.append((number, threading.current_thread().name))

    later = [executor.submit(work, number) for number in range(10)]
    release.set()
    for future in later:
        future.result(WAIT_S)
    assert sorted(k for k, _ in done) == list(range(10)) and len({name for _, name in done}) <= MOST
