"""Work beside the loop: it keeps nobody, and what never ends takes no more than its share of the machine."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import pytest

from homeostat.recovery.exchange.beside import MOST, DaemonExecutor, start

WAIT_S = 30.0


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


def test_a_moment_without_room_for_a_thread_takes_no_place_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    executor = DaemonExecutor()
    with monkeypatch.context() as crowded:
        crowded.setattr(threading.Thread, "start", full)
        for _ in range(MOST):
            with pytest.raises(RuntimeError, match="can't start new thread"):
                executor.submit(sum, (1, 2))
    assert executor.submit(sum, (1, 2)).result(WAIT_S) == 3


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


class Ends(BaseException):
    """Something that is no Exception."""


class Stops(StopIteration):
    """A StopIteration of somebody's own."""


@pytest.mark.parametrize(
    ("raised", "got"),
    [
        (StopIteration(7), RuntimeError), (Stops(), RuntimeError), (StopAsyncIteration(), StopAsyncIteration),
        (asyncio.CancelledError(), asyncio.CancelledError), (SystemExit(0), SystemExit), (Ends(), Ends),
        (KeyboardInterrupt(), KeyboardInterrupt), (GeneratorExit(), GeneratorExit), (MemoryError(), MemoryError),
    ],
)  # fmt: skip
def test_whatever_is_raised_reaches_whoever_waits_in_an_event_loop(
    raised: BaseException, got: type[BaseException]
) -> None:
    def fail() -> None:
        raise raised

    async def wait(begin: Callable[..., Future[None]]) -> BaseException | None:
        ended = asyncio.wrap_future(begin(fail))
        await asyncio.wait({ended}, timeout=WAIT_S)
        assert ended.done()
        return ended.exception()

    for begin in (start, DaemonExecutor().submit):
        error = asyncio.run(wait(begin))
        assert isinstance(error, got)
        if isinstance(raised, StopIteration):
            assert type(raised).__name__ in str(error) and error.__cause__ is raised


def test_who_waits_in_an_event_loop_for_an_iteration_that_stops_gets_an_error_and_no_result() -> None:
    async def wait() -> object:
        asyncio.get_running_loop().set_default_executor(DaemonExecutor())
        return await asyncio.wait_for(asyncio.to_thread(next, iter(())), WAIT_S)

    with pytest.raises(RuntimeError, match="StopIteration"):
        asyncio.run(wait())
