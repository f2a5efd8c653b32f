"""Scene: the plant as recovery knows it, and the one way in which recovery looks up and speaks."""

import asyncio
import math
from collections import deque
from collections.abc import Awaitable, Iterable
from dataclasses import replace
from typing import TypeVar

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.roles import Simulation, Situation
from homeostat.domain.alarm import Priority
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.observation import Message, Observation, Settled, Trouble
from homeostat.domain.ports import Desk
from homeostat.domain.request import Answer, Request
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding
from homeostat.journal.events import Event, Trace
from homeostat.recovery.deadline import SHORTEST_S

FIRST_LOOK = 5
"""Snapshots that the twin needs before it predicts anything."""
RECENT = 300
"""Snapshots that proposers may look back on."""

T = TypeVar("T")


class Scene:
    """Takes every observation once, in order."""

    def __init__(self, desk: Desk, simulation: Simulation, grounding: Grounding, trace: Trace) -> None:
        """``simulation`` is kept up to date; ``grounding`` was asked for what ``trace`` takes besides the events."""
        self._desk, self._simulation, self._grounding, self._trace = desk, simulation, grounding, trace
        self._called: set[str] = set()
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
    def age_s(self) -> float:
        """How long ago the last sample was taken, from which the twin goes on [s]."""
        return max(self.seen_s - self._recent[-1].at_s, 0.0) if self._recent else 0.0

    @property
    def recent(self) -> tuple[Snapshot, ...]:
        """The last minutes, the oldest first."""
        return tuple(self._recent)

    @property
    def ready(self) -> bool:
        """Whether the twin has seen enough to predict anything."""
        return len(self._recent) >= FIRST_LOOK

    def situation(self, diagnosis: Diagnosis, idle: tuple[Finding, ...], left_s: float, cost: Cost | None) -> Situation:
        """What proposers are asked about now.

        ``idle``: what follows without them, ``left_s``: their time [s], ``cost``: what it costs to do nothing.
        """
        now, way, moving = self.now, self.now.way, self.now.rest.commands
        asked = self._recent[-1], diagnosis, now.state, self.recent, idle, left_s, way, moving, cost
        return Situation(*asked, notes=now.notes)

    def take(self, observations: Iterable[Observation]) -> None:
        """Take note of those of ``observations`` that are new."""
        for observation in observations:
            if self._last is not None and observation.now_s <= self._last.now_s:
                continue
            self._last = observation
            if observation.sample is not None:
                self._recent.append(observation.sample)

    async def look(self) -> tuple[Snapshot, ...]:
        """Look up: the time that was thought passes, and everything that was sampled meanwhile reaches the twin."""
        seen = await self._desk.since(self.seen_s)
        self.take(seen)
        fresh = tuple(o.sample for o in seen if o.sample is not None) or (self._recent[-1],)
        self._simulation.observe(fresh)
        return fresh

    async def fresh(self, situation: Situation) -> Situation:
        """The same question about the plant as it is now, and the time left now: it ran on while somebody thought."""
        await self.look()
        left_s = situation.deadline_s - (self._recent[-1].at_s - situation.snapshot.at_s)
        now = self.situation(situation.diagnosis, situation.idle, max(left_s, SHORTEST_S), situation.idle_cost)
        known = replace(now, act_by_s=situation.act_by_s, fallback=situation.fallback, optional=situation.optional)
        return replace(known, tests=situation.tests, earlier=situation.earlier)

    async def within(self, stage: str, process_s: float, work: Awaitable[T]) -> T:
        """The result of ``work``; TimeoutError naming ``stage`` where it takes longer than ``process_s`` [s]."""
        limit = asyncio.timeout(self._desk.wall_s(process_s))
        try:
            async with limit:
                return await work
        except TimeoutError:
            if limit.expired():
                raise TimeoutError(f"{stage} took longer than {process_s:g} s") from None
            raise

    def wall_s(self, process_s: float) -> float:
        """Wall-clock time in which so much process time passes [s]."""
        return self._desk.wall_s(process_s)

    def end(self, began: float, process_s: float) -> float:
        """Time of the event loop at which thinking that ``began`` then and may take ``process_s`` is cut off [s].

        Infinite where thinking costs what is declared: then each answer is cut off where it hangs, by :meth:`cut`.
        """
        return began + self._desk.wall_s(process_s) if math.isinf(self._desk.hang_s) else math.inf

    def cut(self, end: float = math.inf) -> float:
        """Time of the event loop at which what begins now is cut off: at ``end``, or where it hangs [s]."""
        return min(end, asyncio.get_running_loop().time() + self._desk.hang_s)

    def send(self, message: Message) -> None:
        """Tell the guard."""
        self._desk.put(message)

    async def ask(self, request: Request, within_s: float) -> Answer:
        """The guard's final answer to ``request``; it is withdrawn after ``within_s`` [s]."""
        return await self._desk.ask(request, within_s)

    def alarm(self, name: str, cause: str, priority: Priority = Priority.HIGH) -> None:
        """Call a person: ``cause`` is one sentence."""
        self._called.add(name)
        self.send(Trouble(f"recovery:{name}", cause, priority))

    def settle(self, name: str) -> None:
        """What a person was called for is over."""
        self.send(Settled(f"recovery:{name}"))

    def well(self, name: str) -> None:
        """What ``name`` is about went well: if a person was called for it, that is over."""
        if name in self._called:
            self._called.discard(name)
            self.settle(name)

    def record(self, event: Event, at_s: float | None = None) -> None:
        """Say that ``event`` happened at ``at_s``, now where None; what was asked of the graph before it goes first.

        A journal that fails is an alarm; thinking goes on, and the guard releases nothing meanwhile.
        """
        self.flush()
        self._append(event, self.seen_s if at_s is None else at_s)

    def flush(self) -> None:
        """Record what was asked of the graph since the last event."""
        for retrieved in self._grounding.drain():
            self._append(retrieved, self.seen_s)

    def _append(self, event: Event, at_s: float) -> None:
        try:
            self._trace.record(event, at_s)
        except (OSError, ValueError) as error:
            self.alarm("journal", f"recovery's events are not journalled: {error}")
        else:
            self.well("journal")
