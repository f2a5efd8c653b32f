"""Work beside an event loop, in threads that keep nobody: neither the loop nor the end of the process."""

from __future__ import annotations

import itertools
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, ParamSpec, TypeVar, final

P = ParamSpec("P")
T = TypeVar("T")

MOST = 4
"""Most threads that compute for one event loop, those that were given up included."""

_number = itertools.count(1)


def start(function: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
    """Call ``function`` in a thread of its own; the thread ends with the process where it does not end before."""
    job = _Job(Future(), lambda: function(*args, **kwargs))
    _thread(job.do)
    return job.future


@final
class DaemonExecutor(ThreadPoolExecutor):
    """An executor for an event loop: what was given up and computes on keeps neither the loop nor the process.

    Work that finds :data:`MOST` threads busy waits until one of them is free; whoever waits for it has a deadline. So
    a computation that never ends takes no more than its share of the machine, however often it is begun again.
    """

    def __init__(self) -> None:
        """No thread yet."""
        super().__init__(max_workers=1)  # whose own thread is never used
        self._free, self._busy = threading.Lock(), 0
        self._waiting: deque[_Job] = deque()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Call ``fn`` as soon as a thread is free for it."""
        job = _Job(Future(), lambda: fn(*args, **kwargs))
        with self._free:
            if self._busy < MOST:
                _thread(lambda: self._work(job))  # raises where there is no room for one: then no place is taken
                self._busy += 1
            else:
                self._waiting = deque(w for w in self._waiting if not w.future.cancelled())
                self._waiting.append(job)
        return job.future

    def _work(self, job: _Job) -> None:
        """Do ``job``, and then what waits for a thread."""
        while True:
            job.do()
            with self._free:
                if not self._waiting:
                    self._busy -= 1
                    return
                job = self._waiting.popleft()


@dataclass(frozen=True, slots=True)
class _Job:
    """Work, and whoever waits for it."""

    future: Future[Any]
    call: Callable[[], Any]

    def do(self) -> None:
        """Do it, unless nobody wants it any more."""
        if not self.future.set_running_or_notify_cancel():
            return
        try:
            result = self.call()
        except BaseException as error:  # it belongs to whoever waits
            self.future.set_exception(_tellable(error))
        else:
            self.future.set_result(result)


def _tellable(error: BaseException) -> BaseException:
    """``error`` as a coroutine can be told it: a StopIteration would end its wait with a result, or never."""
    if not isinstance(error, StopIteration):
        return error
    told = RuntimeError(f"the work was ended by {type(error).__name__}: {error}")
    told.__cause__ = error
    return told


def _thread(work: Callable[[], None]) -> None:
    threading.Thread(target=work, name=f"beside-{next(_number)}", daemon=True).start()
