"""A plant whose temperature is a straight line: what happens can be worked out in the head.

dT/dt = ``heating`` (F.sp / 0.03 - 0.5) 2 [K/s]: full feed heats at ``heating``, half feed holds, no feed cools.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace

import numpy as np

from homeostat.agents.roles import Action, Agents, Monitoring, Planning, Probing, Proposer, Reprompting, Validation
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.mode import Mode
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import Price, Prices, prices_of
from homeostat.domain.plant.production import Production
from homeostat.domain.plant.rules import GuardRules, QualityRule, StartUp, TripRule, WriteRule
from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.plant.timing import REFERENCE
from homeostat.domain.ports import Clock, Ticket
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult, StepBand
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.requests.seal import Sealer
from homeostat.guard.sequence.sequencer import nominal_route
from homeostat.guard.settings import GuardSettings
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.virtual import Answered
from homeostat.recovery.exchange.exchange import Exchange
from homeostat.recovery.exchange.loop import Hook, Loop
from homeostat.recovery.exchange.worker import Worker
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.release_check import Check, ReleaseCheck
from homeostat.recovery.supervisor import RecoveryLoop
from homeostat.stl.formula import parse
from homeostat.twin.resting import Resting
from homeostat.twin.twin import Interruption
from tests.agents.scripted import NoGraph, ScriptedMonitoring, ScriptedPlanning, ScriptedReprompting
from tests.safety.world import CALM, HOT, TAGS

FULL, HALF, OFF = 0.03, 0.015, 0.0
HORIZON = 100


def feed(value: float, target: str = "running") -> ActionSet:
    """Bring the feed to ``value``."""
    return ActionSet((Command("F.sp", value, 0.005),), target)


def _state(name: str, risk: int, settled: str, target: bool = True, initial: bool = False) -> State:
    ranges = (SetpointRange("F.sp", 0.0, 0.05, FULL), SetpointRange("V.man", 0.0, 1.0, None))
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
)
COOLS = Transition("cools", "running", "reduced", "", parse("T <= 290", TAGS), on_decision=False)
COOLING = replace(MACHINE, transitions=(*MACHINE.transitions, COOLS))
"""A line whose nominal route goes on when it is cold."""
LIMITS = Limits((HOT,), (CALM,))
VENT = FallbackStrategy("vent", feed(OFF, "still"))
DRAIN = FallbackStrategy("drain", replace(VENT.actions, commands=(*VENT.actions.commands, Command("V.man", 1.0, 0.2))))


def priced(limits: Limits, machine: StateMachine = MACHINE, *rows: Price) -> Prices:
    """What the line costs by ``rows``, and by default: product 1 a litre, a release what is made in 9 s."""
    return prices_of(rows, Production("F", FULL), "EUR", limits, machine)


class LinePlant:
    """A link over the line: one sample per second, a lease, and it remembers what arrived on its wire."""

    never_blocks = True

    def __init__(self, end_s: float = 200.0, start: float = 300.0, heating: float = 0.1, level: float = 8.0) -> None:
        self._end_s, self._heating, self.level = end_s, heating, level
        self._hot, self._accepted = start, {"F.sp": FULL, "V.man": None}
        self.now_s = 0.0
        self.readings: list[Snapshot] = []
        self.written: list[tuple[float, tuple[Command, ...]]] = []
        self.disturb: Callable[[float, dict[str, float]], None] = lambda at_s, values: None
        self.read_error: Exception | None = None

    @property
    def ended(self) -> bool:
        return self.now_s >= self._end_s

    def advance(self) -> Snapshot:
        self.now_s += 1.0
        feed = self._accepted["F.sp"] or 0.0
        self._hot += slope(self._heating, feed)
        if self.read_error is not None and self.now_s >= 52.0:
            raise self.read_error
        values = {
            "T": self._hot, "L": self.level, "F": feed, "T.sp": 300.0, "F.sp": feed, "L.sp": 8.0, "V.man": math.nan,
        }  # fmt: skip
        self.disturb(self.now_s, values)
        self.readings.append(Snapshot(self.now_s, values, accepted=dict(self._accepted)))
        return self.readings[-1]

    def take(self) -> LinePlant:
        return self

    def beat(self) -> None:
        """Nothing sheds here."""

    def give_back(self) -> None:
        """Nothing sheds here."""

    def send(self, commands: tuple[Command, ...]) -> Ticket:
        self.written.append((self.now_s, commands))
        self._accepted.update({c.tag: c.value for c in commands})
        return Answered()

    @property
    def hottest(self) -> float:
        return max(s.values["T"] for s in self.readings)


def slope(heating: float, feed: float) -> float:
    """dT/dt [K/s]."""
    return heating * 2.0 * (feed / FULL - 0.5)


def _fed(actions: ActionSet, before: float) -> float:
    """Feed under ``actions`` [L/s]."""
    command = actions.command("F.sp")
    return before if command is None or command.value is None else command.value


class LineTwin:
    """What a twin offers to simulation and release check, over the same straight line; two members."""

    timing = REFERENCE
    resting: tuple[Resting, ...] = ()

    def __init__(self, heating: float = 0.1) -> None:
        self.heating = heating
        self.weights, self.off = (0.5, 0.5), (0.0, 0.01)
        self.last: Snapshot | None = None
        self.result: Callable[[ActionSet], RolloutResult] = lambda actions: RolloutResult.COMPLETED
        self.bug: Callable[[ActionSet], BaseException | None] = lambda actions: None
        self.bands: Callable[[ActionSet], tuple[StepBand, ...]] = lambda actions: ()

    def observe(self, snapshot: Snapshot) -> None:
        if self.last is None or snapshot.at_s > self.last.at_s:
            self.last = snapshot

    def frozen(self) -> LineTwin:
        return copy(self)

    def instrument_errors(self, hypotheses: Sequence[Hypothesis]) -> tuple[Mapping[str, float], ...]:
        return ({},)

    def sampled(self, hypotheses: Sequence[Hypothesis], count: int, name: str) -> int:
        return count

    def roll_out(
        self,
        actions: ActionSet,
        hypotheses: Sequence[Hypothesis],
        ended: Interruption | None = None,
        members: int | None = None,
    ) -> Rollout:
        assert self.last is not None
        judged = members is None  # bugs and results that a test asks for are of what is judged, not of what is counted
        error = self.bug(actions) if judged else None
        if error is not None:
            raise error
        weights: tuple[float, ...] = self.weights
        if judged and self.result(actions) is not RolloutResult.COMPLETED:
            nothing = Trajectory(self.last.at_s, 1.0, {})
            return Rollout(actions.digest, nothing, tuple(hypotheses), (), RolloutResult.BROKE_DOWN, "member 0")
        feeds = np.full(HORIZON, _fed(actions, self.last.values["F.sp"]))
        if ended is not None:
            feeds[math.ceil(ended.after_s) :] = _fed(ended.actions, feeds[0])
        signals = {tag: np.full((2, HORIZON), value) for tag, value in self.last.values.items()}
        signals |= {"F.sp": np.tile(feeds, (2, 1)), "F": np.tile(feeds, (2, 1))}
        for member, mismatch in enumerate(self.off):
            rises = [slope(self.heating, feed) + mismatch * self.heating for feed in feeds.tolist()]
            signals["T"][member] = self.last.values["T"] + np.cumsum(rises)
        if members is not None:
            signals = {tag: np.resize(values, (members, HORIZON)) for tag, values in signals.items()}
            weights = (1.0 / members,) * members
        trajectory = Trajectory(self.last.at_s + 1.0, 1.0, signals)
        return Rollout(
            actions.digest, trajectory, tuple(hypotheses), weights, RolloutResult.COMPLETED, bands=self.bands(actions)
        )


@dataclass
class Stage:
    """A line with a guard and recovery beside it; a test changes what it is about."""

    action: Action
    planning: Planning | None = None
    monitoring: Monitoring = field(default_factory=lambda: ScriptedMonitoring(50.0))
    clock: Clock = field(default_factory=lambda: DeclaredClock(1.0))
    reprompting: Reprompting = field(default_factory=ScriptedReprompting)
    attempts: int = 12
    validation: Validation | None = None
    others: tuple[Proposer, ...] = ()
    bounds: Bounds = field(default_factory=Bounds)
    heating: float = 0.1
    start: float = 300.0
    end_s: float = 120.0
    limits: Limits = LIMITS
    machine: StateMachine = MACHINE
    mode: Mode = Mode.CLOSED_LOOP
    check: Check | None = None
    hook: Hook = lambda seen: None
    probing: Callable[[LineTwin], Probing] | None = None

    def __post_init__(self) -> None:
        self.plant = LinePlant(self.end_s, self.start, self.heating)
        self.twin = LineTwin(self.heating)
        self.trace = MemoryTrace()
        self.shared = self.trace
        self.planning = self.planning or ScriptedPlanning(self.machine, ("reduce",))
        self.lost: list[str] = []
        self.alarms: list[str] = []
        attachment = Attachment(self.shared, self.plant, self.mode, {"check": KEY})
        self.guard = Guard(self._rules(), attachment, GuardSettings(sync_s=10.0))  # however busy the host is
        self.exchange = Exchange(self.clock, self.guard.mailbox.put, self.lost.append)

    def run(self) -> Stage:
        """Run the line to its end."""
        worker = Worker(self.exchange, self._recovery().supervise, self.alarms.append)
        worker.start()
        try:
            Loop(self.guard, self.plant, self.exchange, self.hook).run_virtual()
        finally:
            worker.join(0.5)
            self.guard.stop("the run is over")
        self._worker = worker
        return self

    @property
    def ended(self) -> bool:
        """Whether recovery has come to its end by itself; it is waited for."""
        return self._worker.join(30.0)

    def _rules(self) -> GuardRules:
        route = nominal_route(self.machine, {state.name: () for state in self.machine.states})
        never = parse("true", TAGS)
        return GuardRules(
            "line", TAGS, self.machine, self.limits,
            {x.name: TripRule(x.name, 0.5, 3.0) for x in self.limits.hard},
            {tag: QualityRule(tag, 5.0) for tag in ("T", "L", "F")},
            {"F.sp": WriteRule("F.sp", 0.0005, 3.0), "V.man": WriteRule("V.man", 0.01, 3.0, automatic=True)},
            (DRAIN, VENT), route,
            StartUp(frozenset({"starting"}), {x.name: replace(x, formula=never) for x in self.limits.hard}),
        )  # fmt: skip

    def _recovery(self) -> RecoveryLoop:
        assert self.planning is not None
        agents = Agents(
            self.monitoring,
            (Proposer("scripted", self.planning, self.action, self.reprompting, self.attempts), *self.others),
            TwinSimulation(self.twin, TAGS, self.limits),  # type: ignore[arg-type]
            self.validation or LimitValidation(self.limits, TAGS),
            NoGraph(),  # type: ignore[arg-type]
            None if self.probing is None else self.probing(self.twin),
        )
        rules = PlantRules(
            self.machine, self.limits, priced(self.limits, self.machine), (DRAIN, VENT), {"K": 2.0}, TAGS
        )
        check = self.check or ReleaseCheck(self.twin, self.limits, TAGS, Sealer("check", KEY).seal)  # type: ignore[arg-type]
        return RecoveryLoop(self.exchange, agents, rules, check, self.bounds, self.shared)

    @property
    def kinds(self) -> list[str]:
        """The kinds of events that recovery records, in order, and the states that were entered."""
        return [entry.event.kind for entry in self.trace.entries if entry.event.kind in RECORDED]


RECORDED = {
    "state-entered", "noticed", "deviated", "diagnosed", "fallback-armed", "attempted", "gave-up", "no-action",
    "released", "release-refused",
}  # fmt: skip
KEY = b"a key that proposers do not have"
GOOD, BAD = feed(HALF, "reduced"), feed(FULL, "reduced")
"""Half feed holds the temperature; full feed runs through the limit within the horizon."""


def run(stage: Stage) -> Stage:
    return stage.run()


def monitoring(stage: Stage) -> ScriptedMonitoring:
    assert isinstance(stage.monitoring, ScriptedMonitoring)
    return stage.monitoring


def safe(stage: Stage) -> bool:
    """A fallback has acted and nothing was written after it."""
    return stage.guard.latched is not None and stage.plant.written[-1][1] in (
        DRAIN.actions.commands, VENT.actions.commands,
    )  # fmt: skip
