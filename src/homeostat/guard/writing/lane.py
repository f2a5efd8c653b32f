"""Lanes: calls to what may never answer, each in a thread that may be left behind, one at a time."""

import threading
import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar

T = TypeVar("T")

IDLE_S = 5.0
"""Time after which a thread that nobody needs ends, wall-clock [s]."""


class NoAnswer(TimeoutError):
    """A call has not come back in the time that there was for it; it goes on, and nobody waits for it."""


class Call(Generic[T]):
    """One call that is under way."""

    def __init__(self, name: str, do: Callable[[], T]) -> None:
        """``do`` it when :meth:`run` is called; ``name``: what is called, as an alarm says it."""
        self.name = name
        """What is called."""
        self._do, self._began_s = do, time.monotonic()
        self._result: list[T] = []
        self._error: Exception | None = None
        self._ended = threading.Event()

    @property
    def answered(self) -> bool:
        """Whether it has come back, or has raised."""
        return self._ended.is_set()

    @property
    def age_s(self) -> float:
        """Time since it began, wall-clock [s]."""
        return time.monotonic() - self._began_s

    def wait(self, wait_s: float) -> bool:
        """Whether it has come back within ``wait_s``, wall-clock [s]."""
        return self._ended.wait(wait_s)

    def result(self) -> T:
        """What it came back with; raises what it raised, and NoAnswer where it has not come back."""
        if not self.answered:
            raise NoAnswer(f"{self.name} has not answered for {self.age_s:.1f} s")
        if self._error is not None:
            raise self._error
        return self._result[0]

    def run(self) -> None:
        """Make the call, in a thread that may be left behind; never raises."""
        try:
            self._result.append(self._do())
        except Exception as error:  # whoever waits for it decides what it means
            self._error = error
        except BaseException as error:  # in this thread no person interrupts anything, and no task is cancelled
            self._error = ConnectionError(f"{type(error).__name__}: {error}".rstrip(": "))
        finally:
            self._ended.set()


class Lane:
    """Makes calls of one kind, at most one at a time, so that threads do not pile up behind one that hangs."""

    def __init__(self, name: str, wait_s: float) -> None:
        """``name``: what is called, as an alarm says it; ``wait_s``: longest wait for an answer, wall-clock [s]."""
        self._name, self._wait_s = name, wait_s
        self._call: Call[Any] | None = None
        self._next: Call[Any] | None = None
        self._ready, self._staffed = threading.Condition(), False

    @property
    def busy(self) -> bool:
        """Whether a call is under way."""
        return self._call is not None and not self._call.answered

    def wait(self) -> None:
        """Wait for the call that is under way, if there is one, as long as may be."""
        if self._call is not None:
            self._call.wait(self._wait_s)

    def begin(self, do: Callable[[], T]) -> Call[T]:
        """Call ``do``, and wait for it as long as may be; NoAnswer, without a call, while an earlier one hangs."""
        if self._call is not None and not self._call.answered:
            self._call.result()
        call = Call(self._name, do)
        with self._ready:
            if not self._staffed:
                threading.Thread(target=self._work, name=self._name, daemon=True).start()
            self._call = self._next = call
            self._staffed = True
            self._ready.notify()
        call.wait(self._wait_s)
        return call

    def ask(self, do: Callable[[], T]) -> T:
        """What ``do`` comes back with; NoAnswer where it does not in time, and raises what it raises."""
        return self.begin(do).result()

    def _work(self) -> None:
        """Make one call after the other, until there has been none for a while."""
        while (call := self._awaited()) is not None:
            call.run()

    def _awaited(self) -> Call[Any] | None:
        with self._ready:
            self._staffed = self._ready.wait_for(lambda: self._next is not None, IDLE_S)
            call, self._next = self._next, None
            return call
