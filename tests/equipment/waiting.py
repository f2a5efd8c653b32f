"""How long code was ready to wait: counted from the limits that it named, so that a busy host changes nothing."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest


@dataclass
class Waits:
    """What one thread waited for."""

    limits_s: list[float] = field(default_factory=list)
    """The limit of every wait, whatever it came to [s]."""
    vain_s: float = 0.0
    """Sum of the limits of the waits that ended without what was waited for [s]."""

    def count(self, limit_s: float | None, came: bool) -> None:
        """A wait of at most ``limit_s`` has ended."""
        limit_s = float("inf") if limit_s is None else limit_s
        self.limits_s.append(limit_s)
        self.vain_s += 0.0 if came else limit_s


@contextlib.contextmanager
def waits() -> Iterator[Waits]:
    """Count what this thread waits for, on events and for threads, while this lasts."""
    found, here = Waits(), threading.get_ident()
    wait, join = threading.Event.wait, threading.Thread.join

    def counted_wait(event: threading.Event, timeout: float | None = None) -> bool:
        came = wait(event, timeout)
        if threading.get_ident() == here:
            found.count(timeout, came)
        return came

    def counted_join(thread: threading.Thread, timeout: float | None = None) -> None:
        join(thread, timeout)
        if threading.get_ident() == here:
            found.count(timeout, not thread.is_alive())

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threading.Event, "wait", counted_wait)
        patch.setattr(threading.Thread, "join", counted_join)
        yield found
