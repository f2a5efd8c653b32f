"""Scene: what recovery knows of the plant, and how it looks up, says what happened and keeps its deadlines."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Iterable
from typing import TypeVar

from homeostat.agents.roles import Agents
from homeostat.domain.observation import Observation, Trouble
from homeostat.domain.ports import Desk
from homeostat.domain.snapshot import Snapshot
from homeostat.journal.events import Event, Trace
from homeostat.recovery.progress import ProgressMonitor

FIRST_LOOK = 5
"""Snapshots that the twin needs before it predicts anything."""
RECENT = 300
"""Snapshots that proposers may look back on."""

T = TypeVar("T")


class Scene:
    """Takes every observation once, in order."""

    def __init__(self, desk: Desk, agents: Agents, progress: ProgressMonitor, trace: Trace) -> None:
        """``progress`` is told of every state that is entered; ``trace`` takes what recovery did."""
        self.desk, self.agents, self.progress = desk, agents, progress
        self._trace = trace
        self._recent: deque[Snapshot] = deque(maxlen=RECENT)
        self._last: Observation | None = None

    @property
    def now(self) -> Observation:
        """The freshest observation; AssertionError before the first."""
        assert self._last is not None, "nothing was observed yet"
        return self._last

    @property
    def seen_s(self) -> float:
        """Process time up to which the plant is known [s]."""
        return 0.0 if self._last is None else self._last.now_s

    @property
    def recent(self) -> tuple[Snapshot, ...]:
        """The last minutes, the oldest first."""
        return tuple(self._recent)

    @property
    def snapshot(self) -> Snapshot:
        """The freshest sample."""
        return self._recent[-1]

    def take(self, observations: Iterable[Observation]) -> None:
        """Take note of those of ``observations`` that are new."""
        for observation in observations:
            if self._last is not None and observation.now_s <= self._last.now_s:
                continue
            self._last = observation
            if observation.sample is not None:
                self._recent.append(observation.sample)
            for state, at_s in observation.entered:
                self.progress.entered(state, at_s, len(observation.rest.then))

    async def look(self) -> tuple[Snapshot, ...]:
        """Look up: the time that was thought passes, and everything that was sampled meanwhile reaches the twin."""
        seen = await self.desk.since(self.seen_s)
        self.take(seen)
        fresh = tuple(o.sample for o in seen if o.sample is not None) or (self.snapshot,)
        self.agents.simulation.observe(fresh)
        return fresh

    async def within(self, stage: str, process_s: float, work: Awaitable[T]) -> T:
        """The result of ``work``; TimeoutError naming ``stage`` where it takes longer than ``process_s`` [s]."""
        limit = asyncio.timeout(self.desk.wall_s(process_s))
        try:
            async with limit:
                return await work
        except TimeoutError:
            if limit.expired():
                raise TimeoutError(f"{stage} took longer than {process_s:g} s") from None
            raise

    def record(self, event: Event, at_s: float | None = None) -> None:
        """Say that ``event`` happened at ``at_s``, now where None; what was asked of the graph before it goes first.

        A journal that fails is an alarm; thinking goes on, and the guard releases nothing meanwhile.
        """
        self.flush()
        self._append(event, self.seen_s if at_s is None else at_s)

    def flush(self) -> None:
        """Record what was asked of the graph since the last event."""
        for retrieved in self.agents.grounding.drain():
            self._append(retrieved, self.seen_s)

    def _append(self, event: Event, at_s: float) -> None:
        try:
            self._trace.record(event, at_s)
        except (OSError, ValueError) as error:
            self.alarm("journal", f"recovery's events are not journalled: {error}")

    def alarm(self, name: str, cause: str) -> None:
        """Call a person: ``cause`` is one sentence."""
        self.desk.put(Trouble(f"recovery:{name}", cause))
