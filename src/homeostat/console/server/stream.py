"""A run that plays: moments one after the other at a chosen speed, as server-sent events."""

import asyncio
import time
from collections.abc import AsyncIterator
from typing import Final

from starlette.concurrency import run_in_threadpool

from homeostat.console.opened import OpenedRun
from homeostat.console.text import to_json
from homeostat.console.view import seen

SLOWEST: Final = 0.1
"""Least speed, in process seconds per second [1]."""
FASTEST: Final = 10_000.0
"""Greatest speed [1]."""
_FRAME_S: Final = 0.2
"""Time between two moments [s]."""
_LOOK_S: Final = 1.0
"""Time between two looks at a journal that may have grown [s]."""


async def moments(run: OpenedRun, at_s: float, speed: float) -> AsyncIterator[str]:
    """Moments from ``at_s`` [s] on, ``speed`` process seconds per second, to the end of what is known.

    Each has its process time as identifier, from which a browser goes on when the connection was lost. The whole of
    it is told at first and when something happened. The end is told where the run was closed; else it is followed.
    """
    told, looked = -1, time.monotonic()
    begun, from_s = time.monotonic(), at_s
    while True:
        now = time.monotonic()
        if not run.closed and now - looked >= _LOOK_S:
            looked = now
            await run_in_threadpool(run.refresh)
        at_s = min(from_s + speed * (now - begun), run.last_s)
        if at_s >= run.last_s:  # what comes later is played from when it came
            begun, from_s = now, at_s
        count = len(run.until(at_s))
        moment = await run_in_threadpool(seen, run, at_s, count != told)
        told = count
        yield f"id: {at_s:.3f}\ndata: {to_json(moment)}\n\n"
        if at_s >= run.last_s and run.closed:
            yield "event: end\ndata: {}\n\n"
            return
        await asyncio.sleep(_FRAME_S)
