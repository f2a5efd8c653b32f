"""A run that plays: moments one after the other at a chosen speed, as server-sent events."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable
from typing import Final, TypeVar, final

from starlette.concurrency import run_in_threadpool

from homeostat.console.opened import OpenedRun
from homeostat.console.text import to_json
from homeostat.console.view import seen
from homeostat.recovery.exchange.pacing import Pace

SLOWEST: Final = 0.1
"""Least speed, in process seconds per second [1]."""
FASTEST: Final = 10_000.0
"""Greatest speed [1]."""
_AT_ONCE: Final = 2
T = TypeVar("T")
_FRAME_S: Final = 0.2
"""Time between two moments [s]."""
_LOOK_S: Final = 1.0
"""Time between two looks at a journal that may have grown [s]."""
_BEAT_S: Final = 1.0
"""Longest time without a word, also where nothing is new [s]."""


@final
class Moments:
    """Moments of one run; what several look at at the same time is made once."""

    def __init__(self, run: OpenedRun, ending: threading.Event) -> None:
        """Nobody looks yet; once the server is ``ending``, nobody is told anything more."""
        self._run, self._ending = run, ending
        self._looked = time.monotonic()
        self._making = asyncio.Semaphore(_AT_ONCE)
        self._made: dict[tuple[float, int, bool, Pace | None, int], str] = {}

    async def play(self, at_s: float, speed: float, lasts: Callable[[], bool]) -> AsyncIterator[str]:
        """Moments from ``at_s`` [s] on, ``speed`` process seconds per second, to the end of what is known.

        Nothing more is told once ``lasts`` says that who follows would not be let in any more.

        Each has its process time as identifier, from which a browser goes on when the connection was lost. The whole
        of it is told at first and when something happened. The end is told where the run was closed; else it is
        followed.
        """
        run, told, shown_s, spoke, paced = self._run, -1, -1.0, 0.0, self._run.pace
        begun, from_s = time.monotonic(), at_s
        let_in_s = begun
        while not self._ending.is_set():
            now = time.monotonic()
            if now - let_in_s >= _LOOK_S:
                if not lasts():
                    return
                let_in_s = now
            await self._look(now)
            last_s = run.last_s
            at_s = min(from_s + speed * (now - begun), last_s)
            if at_s >= last_s:  # what comes later is played from when it came
                begun, from_s = now, at_s
            count = run.count(at_s)
            if (count, at_s, run.pace) != (told, shown_s, paced) or now - spoke >= _BEAT_S:
                paced = run.pace
                text = await self._moment(at_s, count, count != told)
                told, shown_s, spoke = count, at_s, now
                yield f"id: {at_s:.3f}\ndata: {text}\n\n"
            if at_s >= last_s and run.closed:
                yield "event: end\ndata: {}\n\n"
                return
            await asyncio.sleep(_FRAME_S)

    async def _threaded(self, make: Callable[[], T]) -> T:
        async with self._making:
            return await run_in_threadpool(make)

    async def _look(self, now: float) -> None:
        if not self._run.closed and now - self._looked >= _LOOK_S:
            self._looked = now
            await self._threaded(self._run.refresh)

    async def _moment(self, at_s: float, count: int, whole: bool) -> str:
        name = at_s, count, whole, self._run.pace, int(time.monotonic() / _BEAT_S)
        if name not in self._made:
            made = await self._threaded(lambda: to_json(seen(self._run, at_s, whole)))
            while len(self._made) >= 8:
                self._made.pop(next(iter(self._made)), None)
            self._made[name] = made
        return self._made[name]
