"""Work beside an event loop, in threads that keep nobody: neither the loop nor the end of the process."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import ParamSpec, TypeVar, final

P = ParamSpec("P")
T = TypeVar("T")

_number = itertools.count(1)


def start(function: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
    """Call ``function`` in a thread of its own; the thread ends with the process where it does not end before."""
    future: Future[T] = Future()

    def work() -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            result = function(*args, **kwargs)
        except BaseException as error:  # it belongs to whoever waits
            future.set_exception(error)
        else:
            future.set_result(result)

    threading.Thread(target=work, name=f"beside-{next(_number)}", daemon=True).start()
    return future


@final
class DaemonExecutor(ThreadPoolExecutor):
    """An executor for an event loop: what was given up and computes on keeps neither the loop nor the process."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Call ``fn`` in a thread of its own."""
        return start(fn, *args, **kwargs)
