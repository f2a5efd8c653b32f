"""A desk whose every tick was written down before, and a recovery that sits at it: no guard and no waiting."""

from __future__ import annotations

import asyncio
import math
import threading
from collections.abc import Callable, Coroutine, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from homeostat.agents.roles import Agents, Plan, Polishing, Probing, Proposer, Situation
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.domain.advice import Advice
from homeostat.domain.diagnosis import Diagnosis, Symptom
from homeostat.domain.events.recovery import Retrieved
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Arm, FallBack, Message, Observation, Trouble
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.prices import Price, PriceKind
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import ActionSet, RecoveryPath, Step
from homeostat.domain.request import Answer, Request, RequestStatus
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Revise, Rollout, StepBand
from homeostat.guard.requests.seal import Sealer
from homeostat.journal import MemoryTrace
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.exchange.beside import DaemonExecutor
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.release_check import ReleaseCheck
from homeostat.recovery.supervisor import RecoveryLoop
from homeostat.twin.twin import Interruption
from tests.agents.scripted import (
    NoGraph,
    ScriptedAction,
    ScriptedMonitoring,
    ScriptedPlanning,
    ScriptedReprompting,
    diagnosis,
)
from tests.recovery.line import COOLING, COOLS, DRAIN, FULL, GOOD, KEY, LIMITS, VENT, LineTwin, feed, priced
from tests.safety.world import CALM, HOT, TAGS, criterion, rule

M = TypeVar("M")
T = TypeVar("T")


def tick(
    at_s: float, hot: float = 300.0, state: str = "running", feed: float = FULL, then: tuple[Step, ...] = (),
    latched: str | None = None, sampled: bool = True,
) -> Observation:  # fmt: skip
    """One tick of the line at ``hot`` [K] under ``feed`` [L/s]; ``then``: what is left of its sequence."""
    values = {"T": hot, "L": 8.0, "F": feed, "T.sp": 300.0, "F.sp": feed, "L.sp": 8.0, "V.man": math.nan}
    sample = Snapshot(at_s, values) if sampled else None
    way = RecoveryPath(COOLING, tuple(s.transition for s in then)) if then else None
    rest = ActionSet((), state, then)
    return Observation(at_s, sample, state, rest, way, None, (), latched, Mode.CLOSED_LOOP, (), sample)


def ticks(first: int, last: int, hot: float = 300.0, state: str = "running", **more: Any) -> tuple[Observation, ...]:
    """One tick per second from ``first`` to ``last``."""
    return tuple(tick(float(at_s), hot, state, **more) for at_s in range(first, last + 1))


class ScriptedDesk:
    """Implements `homeostat.domain.ports.Desk`; looking up costs so many ticks, and a tick may overtake thinking."""

    def __init__(self, observations: Iterable[Observation], thinking: int = 0, overtaking_s: float = math.inf) -> None:
        """``thinking``: ticks that pass at each look; ``overtaking_s``: when what is thought about is cancelled [s]."""
        self._ticks = tuple(observations)
        self._thinking, self._overtaking_s = thinking, overtaking_s
        self._given = self._passed = 0
        self.sent: list[tuple[float, Message]] = []
        self.answer = RequestStatus.CONFIRMED
        self.thoughts = 0

    @property
    def now(self) -> Observation:
        """The freshest tick."""
        return self._ticks[self._passed - 1]

    def more(self, observations: Iterable[Observation]) -> None:
        """The plant goes on."""
        self._ticks += tuple(observations)

    async def next(self) -> Observation | None:
        if self._given == len(self._ticks):
            return None
        self._given += 1
        self._passed = max(self._passed, self._given)
        return self._ticks[self._given - 1]

    async def since(self, at_s: float) -> tuple[Observation, ...]:
        self._passed = min(self._passed + self._thinking, len(self._ticks))
        if self.now.now_s >= self._overtaking_s:
            self._overtaking_s = math.inf
            raise asyncio.CancelledError
        return tuple(o for o in self._ticks[: self._passed] if o.now_s > at_s) or (self.now,)

    @property
    def behind(self) -> bool:
        return self._passed > self._given

    def put(self, message: Message) -> None:
        self.sent.append((self.now.now_s, message))

    async def ask(self, request: Request, within_s: float) -> Answer:
        self.sent.append((self.now.now_s, request))
        return Answer(request.id, self.answer, self.now.now_s)

    async def think(self, work: Coroutine[Any, Any, None]) -> bool:
        self.thoughts += 1
        task = asyncio.get_running_loop().create_task(work)
        await asyncio.wait({task})
        if task.cancelled():
            return False
        task.result()
        return True

    hang_s = math.inf

    def wall_s(self, process_s: float) -> float:
        return process_s


class Watching(ScriptedMonitoring):
    """Monitoring whose symptoms a test decides: ``shows`` says which are active at a time."""

    def __init__(
        self, *notice_s: float, answer: Callable[[float], Diagnosis] = diagnosis,
        shows: Callable[[float], Sequence[str]] = lambda at_s: ("S-HOT",),
    ) -> None:  # fmt: skip
        super().__init__(*notice_s, answer=answer)
        self._shows = shows

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        return tuple(Symptom(rule, 0.0, 2.0, 1.0, 2.0) for rule in self._shows(self.seen[-1] if self.seen else 0.0))


class PlanningByState(ScriptedPlanning):
    """The one way out of each state that the line is run by."""

    async def plan(self, situation: Situation, advice: Advice) -> Plan | Revise:
        name = {"running": "reduce", "still": "resume"}.get(situation.state, "adjust")
        return RecoveryPath(self._machine, tuple(t for t in self._machine.transitions if t.name == name))


class NotingSimulation(TwinSimulation):
    """The twin's, and a note of what was rolled out under which diagnosis."""

    def __init__(self, twin: LineTwin, limits: Limits) -> None:
        super().__init__(twin, TAGS, limits)  # type: ignore[arg-type]
        self.tried: list[tuple[Diagnosis, ActionSet]] = []

    async def roll_out(self, diagnosis: Diagnosis, actions: ActionSet, ended: Interruption | None = None) -> Rollout:
        self.tried.append((diagnosis, actions))
        return await super().roll_out(diagnosis, actions, ended)


class Graph(NoGraph):
    """A knowledge graph of which something was asked before each event."""

    def __init__(self) -> None:
        self.asked: list[Retrieved] = []

    def drain(self) -> tuple[Retrieved, ...]:
        found, self.asked = tuple(self.asked), []
        return found


@dataclass
class Recovery:
    """Recovery at a desk; a test changes what it is about."""

    ticks: Sequence[Observation]
    monitoring: Watching = field(default_factory=lambda: Watching(10.0))
    action: ScriptedAction = field(default_factory=lambda: ScriptedAction(GOOD))
    thinking: int = 0
    overtaking_s: float = math.inf
    bounds: Bounds = field(default_factory=Bounds)
    limits: Limits = LIMITS
    attempts: int = 1
    improves: bool = False
    heating: float = 0.1
    graph: Graph = field(default_factory=Graph)
    band: StepBand | None = None
    probing: Probing | None = None
    rows: tuple[Price, ...] = ()
    others: tuple[Proposer, ...] = ()
    polishing: Polishing | None = None
    machine: StateMachine = COOLING
    passing: frozenset[str] = frozenset()
    line: LineTwin | None = None

    def __post_init__(self) -> None:
        self.desk = ScriptedDesk(self.ticks, self.thinking, self.overtaking_s)
        self.twin, self.trace = self.line or LineTwin(self.heating), MemoryTrace()
        self.twin.bands = lambda actions: () if self.band is None else (self.band,) * len(actions.then)
        proposer = Proposer(
            "scripted", PlanningByState(self.machine), self.action, ScriptedReprompting(), self.attempts, self.improves
        )
        self.simulation = NotingSimulation(self.twin, self.limits)
        validation = LimitValidation(self.limits, TAGS)
        proposers = (proposer, *self.others)
        agents = Agents(
            self.monitoring,
            proposers,
            self.simulation,
            validation,
            self.graph,
            self.probing,
            self.polishing,  # type: ignore[arg-type]
        )
        prices = priced(self.limits, self.machine, *self.rows)
        rules = PlantRules(self.machine, self.limits, prices, (DRAIN, VENT), {"K": 2.0}, TAGS, self.passing)
        check = ReleaseCheck(self.twin, self.limits, TAGS, Sealer("check", KEY).seal)  # type: ignore[arg-type]
        self.loop = RecoveryLoop(self.desk, agents, rules, check, self.bounds, self.trace)

    def run(self, *more: Observation) -> Recovery:
        """Supervise until there is no further tick."""
        self.desk.more(more)
        self.wait_for(self.loop.supervise())
        return self

    def wait_for(self, work: Coroutine[Any, Any, T]) -> T:
        """The result of ``work``, in an event loop like that of recovery's thread."""
        with asyncio.Runner() as runner:
            runner.get_loop().set_default_executor(DaemonExecutor())
            return runner.run(work)

    def sent(self, kind: type[M]) -> list[tuple[float, M]]:
        """Messages of one kind, each with the time of the tick after which it was sent [s]."""
        return [(at_s, m) for at_s, m in self.desk.sent if isinstance(m, kind)]

    @property
    def released(self) -> list[float]:
        """When something was released [s]."""
        return [at_s for at_s, _ in self.sent(Request)]

    @property
    def handed_over(self) -> list[str]:
        """Why fallbacks were asked for."""
        return [m.reason for _, m in self.sent(FallBack)]

    @property
    def alarms(self) -> list[tuple[str, str]]:
        """What a person was called for."""
        return [(m.name, m.cause) for _, m in self.sent(Trouble)]

    @property
    def armed(self) -> list[Arm]:
        """Rankings of the fallbacks, in order."""
        return [m for _, m in self.sent(Arm)]

    @property
    def kinds(self) -> list[str]:
        """Kinds of the events that were recorded, in order."""
        return [entry.event.kind for entry in self.trace.entries]

    def when(self, kind: type) -> list[float]:
        """When events of one kind were recorded [s]."""
        return [e.at_s for e in self.trace.entries if isinstance(e.event, kind)]


SOFT = Limits((HOT,), (CALM, criterion("ACC-SOFT", "T <= 306")))
"""Limits with a wish, which forbids nothing."""
DEAR = (Price(PriceKind.CRITERION, "ACC-SOFT", 1080.0),)
"""To miss that wish by 2 K costs ten times what the line makes meanwhile."""
FREE = (Price(PriceKind.STATE, "reduced", 0.0),)
"""To run reduced costs nothing but what is not made."""
MILD = Limits((HOT, rule("LIM-MILD", LimitKind.TRIP_LIMIT, "T <= 306")), (CALM,))
"""Limits of which one forbids without protecting the plant: where nothing can be released, it may be missed."""
AT_ONCE = Bounds(intervention=InterventionBounds(waits=0))
"""Nobody waits: where nothing is approved, the fallback acts."""
FINE, DOOMED = 300.0, 305.0
"""At full feed the line heats by 10 K within the horizon: from 305 K through the limit of 313 K [K]."""
NEXT = (Step(COOLS, ()),)
"""What is left of the sequence: the line goes on when it is cold."""


def nothing(at_s: float) -> Diagnosis:
    """The diagnosis of a healthy plant."""
    return Diagnosis(at_s, (), ())


def at_first(answer: Callable[[float], Diagnosis], then: Callable[[float], Diagnosis]) -> Callable[[float], Diagnosis]:
    """One diagnosis before 20 s, another one from then on."""
    return lambda at_s: answer(at_s) if at_s < 20.0 else then(at_s)


def watching(*noticed_s: float, answer: Callable[[float], Diagnosis] = diagnosis) -> Watching:
    return Watching(*noticed_s, answer=answer)


def hanging(let_go: threading.Event) -> Callable[[ActionSet], None]:
    """A twin that does not come back before it is let go."""

    def wait(actions: ActionSet) -> None:
        let_go.wait(5.0)

    return wait


def latched(first: int, last: int) -> tuple[Observation, ...]:
    return ticks(first, last, DOOMED, latched="'T <= 313' is violated")


MORE = feed(0.02, "reduced")
CALM_20 = Bounds(intervention=InterventionBounds(calm_s=20.0))


SLACK = Bounds(intervention=InterventionBounds(slack_s=5.0, repeat_s=10.0))


def late(hot: float = FINE, last: int = 20, **changed: Any) -> Recovery:
    """A line that should have gone on by 10 s, and about which nobody notices anything."""
    made = {"monitoring": watching(answer=nothing), "bounds": SLACK, "band": StepBand(8.0, 10.0), **changed}
    return Recovery(ticks(1, last, hot, then=NEXT), **made)
