"""Watch: monitoring behind a deadline; what it is shown while it is still thinking waits until it is done."""

import asyncio
from collections import deque
from concurrent.futures import Future

from homeostat.agents.roles import Monitoring
from homeostat.domain.diagnosis import Diagnosis, Symptom
from homeostat.domain.observation import Observation
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import FallbackNeeded, NoActionNeeded, Resolution
from homeostat.recovery.exchange.beside import start

BACKLOG = 4096
"""Most snapshots that wait for a monitoring that is still thinking."""


class Watch:
    """Shows every snapshot to monitoring, in order, and never calls it twice at a time."""

    def __init__(self, monitoring: Monitoring) -> None:
        """``monitoring`` is used by nobody else."""
        self._monitoring = monitoring
        self._waiting: deque[Snapshot] = deque(maxlen=BACKLOG)
        self._thinking: Future[Diagnosis] | None = None
        self._out_of_date = self._latched = False

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        """The symptoms that are active now."""
        return self._monitoring.symptoms

    def follow(self, outcome: Resolution) -> None:
        """What was done about the last diagnosis."""
        self._monitoring.follow(outcome)

    def stands_back(self, seen: Observation) -> bool:
        """Whether a fallback has acted and nobody has reset it; monitoring is told once of either."""
        before, self._latched = self._latched, seen.latched is not None
        if seen.latched is not None:
            self.forget()
            if not before:
                self.follow(FallbackNeeded(seen.latched, seen.now_s))
        elif before:
            self.follow(NoActionNeeded(seen.now_s, 0.0))
        return self._latched

    def notices(self, snapshot: Snapshot | None) -> bool:
        """Take one more snapshot, if there is one; whether something needs to be explained now.

        A diagnosis that finished after its deadline is still delivered at the next question, because monitoring already
        counts its symptoms as explained. Where monitoring has seen something new meanwhile, it is out of date.
        """
        if snapshot is not None:
            self._waiting.append(snapshot)
        if self._thinking is not None and not self._thinking.done():
            return False
        if self._out_of_date:
            self._thinking, self._out_of_date = None, False
        noticed = False
        while self._waiting:
            noticed = self._monitoring.notices(self._waiting.popleft()) or noticed
        if noticed:
            self._thinking = None
        return noticed or self._thinking is not None

    def forget(self) -> None:
        """Nobody wants to know any more what was asked before."""
        self._out_of_date = self._thinking is not None

    async def diagnose(self, deviates: bool, wall_s: float) -> Diagnosis:
        """The diagnosis as of now; TimeoutError where it takes longer than ``wall_s``, and it goes on all the same [s].

        Where an earlier diagnosis still goes on, or has come too late, it is that one.
        """
        async with asyncio.timeout(wall_s):
            if self._thinking is not None and self._out_of_date:
                await self._end(self._thinking)
            if self._thinking is None:
                self._thinking = start(self._monitoring.diagnose, deviates)
            return (await self._end(self._thinking)).result()

    async def _end(self, thinking: Future[Diagnosis]) -> asyncio.Future[Diagnosis]:
        """Wait until monitoring has done ``thinking``, and is free for the next question."""
        found = asyncio.wrap_future(thinking)
        await asyncio.wait({found})
        self._thinking, self._out_of_date = None, False
        return found
