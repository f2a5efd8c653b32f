"""Watch: monitoring behind a deadline; what it is shown while it is still thinking waits until it is done."""

from __future__ import annotations

import asyncio
from collections import deque
from concurrent.futures import Future

from homeostat.agents.crew import Monitoring
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.snapshot import Snapshot
from homeostat.recovery.beside import start

BACKLOG = 4096
"""Most snapshots that wait for a monitoring that is still thinking."""


class Watch:
    """Shows every snapshot to monitoring, in order, and never calls it twice at a time."""

    def __init__(self, monitoring: Monitoring) -> None:
        """``monitoring`` is used by nobody else but for its symptoms and outcomes."""
        self._monitoring = monitoring
        self._waiting: deque[Snapshot] = deque(maxlen=BACKLOG)
        self._thinking: Future[Diagnosis] | None = None

    def notices(self, snapshot: Snapshot | None) -> bool:
        """Take one more snapshot, if there is one; whether something needs to be explained now."""
        if snapshot is not None:
            self._waiting.append(snapshot)
        if self._thinking is not None and not self._thinking.done():
            return False
        noticed = False
        while self._waiting:
            noticed = self._monitoring.notices(self._waiting.popleft()) or noticed
        return noticed

    async def diagnose(self, departed: bool, wall_s: float) -> Diagnosis:
        """What is believed now; TimeoutError where it takes longer than ``wall_s``, and it goes on all the same [s].

        Where an earlier diagnosis still goes on, that one is waited for.
        """
        if self._thinking is None or self._thinking.done():
            self._thinking = start(self._monitoring.diagnose, departed)
        async with asyncio.timeout(wall_s):
            return await asyncio.shield(asyncio.wrap_future(self._thinking))
