"""A plant whose temperature is a straight line: what happens can be worked out in the head.

dT/dt = ``heating`` (F.sp / 0.03 - 0.5) 2 [K/s]: full feed heats at ``heating``, half feed holds, no feed cools.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from homeostat.agents.bounds import Budget, Patience
from homeostat.agents.crew import Action, Crew, Monitoring, Planning, Proposer, Reprompting, Simulation, Validation
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.domain.behaviour import SetpointRange, State, StateMachine, Transition
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.limits import Limits
from homeostat.domain.ports import Clock
from homeostat.domain.production import Production
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult, StepBand
from homeostat.guard.gate import Gate
from homeostat.guard.sequencer import Sequencer, nominal_route
from homeostat.links.clock import DeclaredClock
from homeostat.recovery.release_check import TwinReleaseCheck
from homeostat.recovery.supervisor import Supervisor
from homeostat.stl.formula import parse
from homeostat.trace import MemoryTrace
from tests.agents.scripted import NoGraph, ScriptedMonitoring, ScriptedPlanning, ScriptedReprompting
from tests.safety.world import CALM, DRAIN, HOT, TAGS, VENT

FULL, HALF, OFF = 0.03, 0.015, 0.0
HORIZON = 100


def feed(value: float, target: str = "running") -> ActionSet:
    """Bring the feed to ``value``."""
    return ActionSet((Command("F.sp", value, 0.005),), target)


def _state(name: str, risk: int, settled: str, target: bool = True, initial: bool = False) -> State:
    ranges = (SetpointRange("F.sp", 0.0, 0.05, FULL),)
    return State(name, name, risk, initial, target, parse(settled, TAGS), frozenset(), ranges)


def _step(name: str, source: str, target: str, guard: str = "true", event: str = "fault_diagnosed") -> Transition:
    return Transition(name, source, target, event, parse(guard, TAGS), event == "fault_diagnosed")


MACHINE = StateMachine(
    "line",
    (
        _state("starting", 0, "true", target=False, initial=True),
        _state("running", 0, "true", target=False),
        _state("reduced", 1, "F.sp >= 0.01"),
        _state("still", 2, "F.sp <= 0.001"),
    ),
    (
        _step("start", "starting", "running", "L >= 5", "started"),
        _step("reduce", "running", "reduced"),
        _step("adjust", "reduced", "reduced"),
        _step("hold", "running", "still"),
        _step("hold_reduced", "reduced", "still"),
        _step("when_cold", "running", "reduced", "T <= 290"),
    ),
)  # fmt: skip
LIMITS = Limits((HOT,), (CALM,))


class LinePlant:
    """Implements the plant's port: one snapshot per second, and it runs on while somebody thinks."""

    def __init__(
        self, clock: Clock, end_s: float = 200.0, start: float = 300.0, heating: float = 0.1, level: float = 8.0,
        sample: Callable[[Snapshot], tuple[Command, ...]] = lambda snapshot: (),
    ) -> None:  # fmt: skip
        """``sample``: what the basic control system commands after each snapshot."""
        self._sample = sample
        self._clock, self._end_s, self._heating, self._level = clock, end_s, heating, level
        self._hot, self._feed, self._now_s, self._owed_s = start, FULL, 0.0, 0.0
        self._snapshots: list[Snapshot] = []
        self.written: list[tuple[float, tuple[Command, ...]]] = []
        self.disturb: Callable[[float, dict[str, float]], None] = lambda at_s, values: None
        self.read_error: Exception | None = None

    async def snapshots(self) -> AsyncIterator[Snapshot]:
        given = 0
        while True:
            if given == len(self._snapshots):
                if self._now_s >= self._end_s:
                    return
                self._second()
            yield self._snapshots[given]
            given += 1

    async def since(self, at_s: float) -> tuple[Snapshot, ...]:
        if self.read_error is not None:
            raise self.read_error
        self._catch_up()
        return tuple(s for s in self._snapshots if s.at_s > at_s) or (self._snapshots[-1],)

    async def write(self, commands: tuple[Command, ...]) -> None:
        self._catch_up()
        self.written.append((self._now_s, commands))
        self._command(commands)

    def _command(self, commands: tuple[Command, ...]) -> None:
        for command in commands:
            if command.tag == "F.sp" and command.value is not None:
                self._feed = command.value

    def _catch_up(self) -> None:
        self._owed_s += self._clock.collect_s()
        while self._owed_s >= 1.0 and self._now_s < self._end_s:
            self._owed_s -= 1.0
            self._second()

    def _second(self) -> None:
        self._now_s += 1.0
        self._hot += slope(self._heating, self._feed)
        values = {
            "T": self._hot, "L": self._level, "F": self._feed, "T.sp": 300.0, "F.sp": self._feed, "L.sp": 8.0,
            "V.man": math.nan,
        }  # fmt: skip
        self.disturb(self._now_s, values)
        self._snapshots.append(Snapshot(self._now_s, values))
        self._command(self._sample(self._snapshots[-1]))


def slope(heating: float, feed: float) -> float:
    """dT/dt [K/s]."""
    return heating * 2.0 * (feed / FULL - 0.5)


class LineTwin:
    """What a twin offers to simulation and rehearsal, over the same straight line; two members, equal weights."""

    def __init__(self, heating: float = 0.1) -> None:
        self.heating = heating
        self.last: Snapshot | None = None
        self.result: Callable[[ActionSet], RolloutResult] = lambda actions: RolloutResult.COMPLETED
        self.bug: Callable[[ActionSet], Exception | None] = lambda actions: None
        self.bands: Callable[[ActionSet], tuple[StepBand, ...]] = lambda actions: ()

    def observe(self, snapshot: Snapshot) -> None:
        if self.last is None or snapshot.at_s > self.last.at_s:
            self.last = snapshot

    def instrument_errors(self, hypotheses: Sequence[Hypothesis]) -> tuple[Mapping[str, float], ...]:
        return ({},)

    def roll_out(self, actions: ActionSet, hypotheses: Sequence[Hypothesis]) -> Rollout:
        assert self.last is not None
        error = self.bug(actions)
        if error is not None:
            raise error
        weights = (0.5, 0.5)
        if self.result(actions) is not RolloutResult.COMPLETED:
            nothing = Trajectory(self.last.at_s, 1.0, {})
            return Rollout(actions.digest, nothing, tuple(hypotheses), (), RolloutResult.BROKE_DOWN, "member 0")
        command = actions.command("F.sp")
        feed = self.last.values["F.sp"] if command is None or command.value is None else command.value
        values = dict(self.last.values) | {"F.sp": feed, "F": feed}
        signals = {tag: np.full((2, HORIZON), value) for tag, value in values.items()}
        seconds = np.arange(1, HORIZON + 1)
        for member, mismatch in enumerate((0.0, 0.01)):
            signals["T"][member] = (
                self.last.values["T"] + (slope(self.heating, feed) + mismatch * self.heating) * seconds
            )
        trajectory = Trajectory(self.last.at_s + 1.0, 1.0, signals)
        return Rollout(
            actions.digest, trajectory, tuple(hypotheses), weights, RolloutResult.COMPLETED, bands=self.bands(actions)
        )


@dataclass
class Stage:
    """Everything around a supervisor; a test changes what it is about."""

    action: Action
    planning: Planning | None = None
    monitoring: Monitoring = field(default_factory=lambda: ScriptedMonitoring(50.0))
    clock: Clock = field(default_factory=lambda: DeclaredClock(1.0))
    reprompting: Reprompting = field(default_factory=ScriptedReprompting)
    attempts: int = 12
    simulation: Simulation | None = None
    validation: Validation | None = None
    others: tuple[Proposer, ...] = ()
    patience: Patience = field(default_factory=Patience)
    budget: Budget = field(default_factory=Budget)
    heating: float = 0.1
    start: float = 300.0
    end_s: float = 120.0
    limits: Limits = LIMITS
    machine: StateMachine = MACHINE

    def __post_init__(self) -> None:
        route = nominal_route(self.machine, {state.name: () for state in self.machine.states})
        self.sequencer = Sequencer(self.machine, self.limits, route)
        self.plant = LinePlant(self.clock, self.end_s, self.start, self.heating, sample=self.sequencer.sample)
        self.twin = LineTwin(self.heating)
        self.trace = MemoryTrace()
        self.rehearsal = TwinReleaseCheck(self.twin, self.limits, TAGS)  # type: ignore[arg-type]
        self.gate = Gate(self.plant, self.limits, DRAIN, self.rehearsal, self.sequencer)
        self.planning = self.planning or ScriptedPlanning(self.machine, ("reduce",))

    def supervisor(self) -> Supervisor:
        """The wired supervisor."""
        assert self.planning is not None
        crew = Crew(
            self.monitoring,
            (Proposer("scripted", self.planning, self.action, self.reprompting, self.attempts), *self.others),
            self.simulation or TwinSimulation(self.twin, TAGS, self.limits),  # type: ignore[arg-type]
            self.validation or LimitValidation(self.limits, TAGS),
            NoGraph(),  # type: ignore[arg-type]
        )
        return Supervisor(
            self.plant, self.clock, crew, self.gate, self.rehearsal, self.sequencer, self.machine, self.limits,
            Production("F", FULL), (DRAIN, VENT), {"K": 2.0}, self.patience, self.budget, self.trace,
        )  # fmt: skip

    @property
    def kinds(self) -> list[str]:
        """The kinds of events in the trace, in order."""
        return [entry.event.kind for entry in self.trace.entries]


GOOD, BAD = feed(HALF, "reduced"), feed(FULL, "reduced")
"""Half feed holds the temperature; full feed runs through the limit within the horizon."""


def run(stage: Stage) -> Stage:
    asyncio.run(stage.supervisor().supervise())
    return stage


def monitoring(stage: Stage) -> ScriptedMonitoring:
    assert isinstance(stage.monitoring, ScriptedMonitoring)
    return stage.monitoring


def safe(stage: Stage) -> bool:
    """The fallback has acted and nothing was written after it."""
    return stage.gate.latched is not None and stage.plant.written[-1][1] == stage.gate.armed.actions.commands
