"""An attached plant from start to stop: a guard and thinking beside it, in two processes that are minded by a third."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from types import FrameType
from typing import Final

from homeostat.service.attached.guarding import REFUSED, Attaching, guard
from homeostat.service.attached.place import hold, refuse_unfit
from homeostat.service.keeping.minded import Minded, Patience
from homeostat.service.keeping.notify import Notify
from homeostat.service.thinking.consulted import Consulted

GUARD: Final = Patience(start_s=60.0, quiet_s=20.0, again_s=0.5, most_s=1.0)
"""The guard comes back at once, and at the latest 1 s after it has died again and again: nobody watches meanwhile."""
THINKING: Final = Patience(start_s=120.0, quiet_s=30.0, again_s=1.0, most_s=60.0)
"""Thinking has more to load, and steps back where it does not last."""
HISTORIAN: Final = Patience(start_s=60.0, quiet_s=60.0, again_s=1.0, most_s=30.0)
"""The historian may wait for a disk: the guard has a backlog for it, in which events outlive samples."""
TABLES_S: Final = 20.0
"""Longest that the historian may take to end: it makes tables of its log, or else the next one does [s]."""
STOP_S: Final = 15.0
"""Longest that the guard may take to end: it gives the lease back, and closes its journal, wall-clock [s]."""
LOOK_S: Final = 0.05
"""How often the processes are looked at, wall-clock [s]."""
ALIVE_S: Final = 1.0
"""How often the service manager is told that the guard goes on, wall-clock [s]."""


@dataclass(frozen=True, slots=True)
class ThoughtOf:
    """What the process that thinks is told when it begins."""

    plant: str
    """Name of the plant, or path of its folder."""
    consulted: Consulted
    """Who proposes, and what is known from before."""


def attach(attaching: Attaching, thought: ThoughtOf, tell: Callable[[str], object]) -> int:
    """Keep a plant attached until a signal ends it (SIGINT, SIGTERM); the exit status, 2 where it cannot begin.

    ``thought`` is for the process that thinks; ``tell`` is told what becomes of the two. Raises AttachError where
    another service has the directory, or it holds something else.
    """
    lock = hold(attaching.directory)
    try:
        refuse_unfit(attaching.directory, attaching.rules.plant, attaching.rules.configuration)
        return _kept(attaching, thought, tell)
    finally:
        os.close(lock)


def _kept(attaching: Attaching, thought: ThoughtOf, tell: Callable[[str], object]) -> int:
    stopping: list[int] = []

    def stop(number: int, frame: FrameType | None) -> None:
        stopping.append(number)

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    manager, first = Notify(), os.getpid()  # who is gone before a child has asked for it is known to be gone
    guarding = Minded("the guard", lambda pulse: guard(attaching, pulse, first), GUARD, tell)
    thinking = Minded("thinking", partial(_think, attaching, thought, first), THINKING, tell)
    keep = partial(_keep, attaching, first)
    history = None if attaching.history is None else Minded("the historian", keep, HISTORIAN, tell)
    ready, told = False, 0.0
    try:
        while not stopping:
            alive = guarding.look()
            if not ready and guarding.child is None and guarding.status == REFUSED:
                return REFUSED
            if alive and not ready:
                ready = True
                manager.tell(f"READY=1\nSTATUS={attaching.rules.plant} is attached")
                tell(f"{attaching.rules.plant} is attached in {str(attaching.directory)!r}; the guard observes")
            if alive and time.monotonic() - told >= ALIVE_S:
                told = time.monotonic()
                manager.tell("WATCHDOG=1")
            if ready:
                thinking.look()
                if history is not None:
                    history.look()
            time.sleep(LOOK_S)
        manager.tell("STOPPING=1")
        guarding.end(STOP_S)
        tell("stopped; nothing was written, and the plant's own control goes on")
        return 0
    finally:
        guarding.end(STOP_S)
        thinking.end(0.5)
        if history is not None:
            history.end(TABLES_S)
        for number, handler in before.items():
            signal.signal(number, handler)


def _think(attaching: Attaching, thought: ThoughtOf, first: int, pulse: int) -> int:
    """Turn this process into one that thinks; it never returns where that succeeds."""
    told = str(attaching.directory), thought.plant, repr(attaching.pace), str(pulse), str(first)
    return _become("homeostat.service.thinking", *told, thought.consulted.to_text())


def _keep(attaching: Attaching, first: int, pulse: int) -> int:
    """Turn this process into one that keeps the history; it never returns where that succeeds."""
    given = str(attaching.directory), str(attaching.history), str(pulse), str(first)
    return _become("homeostat.service.historian", *given)


def _become(module: str, *arguments: str) -> int:
    # -P: what lies in the folder that the service was started in is no code of anybody's
    os.execv(sys.executable, [sys.executable, "-P", "-m", module, *arguments])
