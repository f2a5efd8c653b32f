"""A timetable: what begins and ends at stated process times, looked up once per second for days on end."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from typing import Generic, Protocol, TypeVar


class Timed(Protocol):
    """Something with a beginning and an end."""

    @property
    def from_s(self) -> float:
        """Process time at which it begins [s]."""
        ...

    @property
    def to_s(self) -> float:
        """Process time before which it ends [s]."""
        ...


T = TypeVar("T", bound=Timed)


class Timetable(Generic[T]):
    """Entries by time; each costs nothing before it begins and after it has ended."""

    def __init__(self, entries: Iterable[T]) -> None:
        """``entries`` in any order; those that begin together keep theirs. ValueError where a time is not a number."""
        entries = tuple(entries)
        for e in entries:
            if math.isnan(e.from_s) or math.isnan(e.to_s):
                raise ValueError(f"{e!r}: beginning and end must be times [s]")
        self._waiting = deque(sorted(entries, key=lambda e: e.from_s))
        self.active: tuple[T, ...] = ()
        """Entries that have begun and not ended, the longest-standing first."""

    def move(self, now_s: float) -> tuple[T, ...]:
        """Go on to process time ``now_s`` [s], never back; the entries that begin."""
        begun: list[T] = []
        while self._waiting and self._waiting[0].from_s <= now_s:
            begun.append(self._waiting.popleft())
        if begun or any(e.to_s <= now_s for e in self.active):
            self.active = tuple(e for e in (*self.active, *begun) if e.to_s > now_s)
        return tuple(begun)
