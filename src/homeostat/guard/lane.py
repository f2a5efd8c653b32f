"""Lanes: calls to what may never answer, each in a thread that may be left behind, one at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class NoAnswer(TimeoutError):
    """A call has not come back in the time that there was for it; it goes on, and nobody waits for it."""


class Call(Generic[T]):
    """One call that is under way."""

    def __init__(self, name: str, do: Callable[[], T], after: Callable[[], None] = lambda: None) -> None:
        """Begin to ``do`` it, in a thread that keeps no process alive; ``after``: what that thread does then.

        ``name``: what is called, as an alarm says it.
        """
        self._name, self._do, self._after, self._began_s = name, do, after, time.monotonic()
        self._result: list[T] = []
        self._error: BaseException | None = None
        self._ended = threading.Event()
        threading.Thread(target=self._run, name=name, daemon=True).start()

    @property
    def answered(self) -> bool:
        """Whether it has come back, or has raised."""
        return self._ended.is_set()

    def wait(self, wait_s: float) -> bool:
        """Whether it has come back within ``wait_s``, wall-clock [s]."""
        return self._ended.wait(wait_s)

    def result(self) -> T:
        """What it came back with; raises what it raised, and NoAnswer where it has not come back."""
        if not self.answered:
            raise NoAnswer(f"{self._name} has not answered for {time.monotonic() - self._began_s:.1f} s")
        if self._error is not None:
            raise self._error
        return self._result[0]

    def _run(self) -> None:
        try:
            self._result.append(self._do())
        except BaseException as error:  # whoever waits for it decides what it means
            self._error = error
        finally:
            self._ended.set()
        self._after()


class Lane:
    """Makes calls of one kind, at most one at a time, so that threads do not pile up behind one that hangs."""

    def __init__(self, name: str, wait_s: float) -> None:
        """``name``: what is called, as an alarm says it; ``wait_s``: longest wait for an answer, wall-clock [s]."""
        self._name, self.wait_s = name, wait_s
        self._call: Call[object] | None = None

    @property
    def busy(self) -> bool:
        """Whether a call is under way."""
        return self._call is not None and not self._call.answered

    def begin(self, do: Callable[[], T]) -> Call[T]:
        """Call ``do``, and wait for it as long as may be; NoAnswer, without a call, while an earlier one hangs."""
        if self._call is not None and not self._call.answered:
            self._call.result()
        call = Call(self._name, do)
        self._call = call  # type: ignore[assignment]
        call.wait(self.wait_s)
        return call

    def ask(self, do: Callable[[], T]) -> T:
        """What ``do`` comes back with; NoAnswer where it does not in time, and raises what it raises."""
        return self.begin(do).result()
