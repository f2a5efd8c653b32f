"""A process that was started here: whether it goes on, when it said so last, and how it ends."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable
from typing import Final, final

_LOOK_S: Final = 0.02


@final
class Child:
    """A forked process with a pipe into which it writes a byte whenever it wants to say that it goes on."""

    def __init__(self, work: Callable[[int], int]) -> None:
        """Begin ``work`` in a process of its own, which ends with the status that it returns.

        ``work`` is given the descriptor of the pipe, which a process that it turns into inherits. Raises OSError where
        the machine has no room for another process or pipe.
        """
        self._pulse, theirs = os.pipe()
        os.set_blocking(self._pulse, False)
        os.set_blocking(theirs, False)
        os.set_inheritable(theirs, True)
        sys.stdout.flush()
        sys.stderr.flush()
        try:
            self.pid = os.fork()
            """Its number."""
        except OSError:
            os.close(self._pulse)
            os.close(theirs)
            raise
        if self.pid == 0:
            os.close(self._pulse)
            _carry_out(work, theirs)
        os.close(theirs)
        self.began = self.seen = time.monotonic()
        """When it began, and when it was heard of last, by the monotonic clock [s]."""
        self.pulsed = False
        """Whether it was heard of at all."""
        self._status: int | None = None

    def listen(self) -> bool:
        """Take what it has said; whether it has said anything since this was last asked."""
        said = False
        with contextlib.suppress(BlockingIOError):
            while os.read(self._pulse, 4096):
                said = True
        if said:
            self.seen, self.pulsed = time.monotonic(), True
        return said

    @property
    def status(self) -> int | None:
        """How it ended, a signal as its negative number; None while it goes on."""
        if self._status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self._status = os.waitstatus_to_exitcode(status)
                os.close(self._pulse)
        return self._status

    def end(self, number: signal.Signals, within_s: float) -> int:
        """Send it signal ``number``, kill it where it has not ended ``within_s`` later [s]; how it ended."""
        until = time.monotonic() + within_s
        if self.status is None:
            os.kill(self.pid, number)
        while (status := self.status) is None:
            if time.monotonic() >= until:
                os.kill(self.pid, signal.SIGKILL)
            time.sleep(_LOOK_S)
        return status


def _carry_out(work: Callable[[int], int], pulse: int) -> None:
    """In the new process: ``work``, and never back into what the old one was about to do."""
    status = 1
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL if number is signal.SIGTERM else signal.SIG_IGN)
        status = work(pulse)
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


def ended(status: int) -> str:
    """How a process ended, in words."""
    return f"it was killed by {signal.Signals(-status).name}" if status < 0 else f"it ended with status {status}"
