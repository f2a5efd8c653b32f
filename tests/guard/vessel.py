"""A heated vessel with a guard: rules, a plant that obeys or not, and a journal in memory."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import Observation
from homeostat.domain.plant.limits import Limit, LimitKind, Limits
from homeostat.domain.plant.rules import GuardRules, QualityRule, StartUp, TripRule, WriteRule
from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.plant.tag import Range, Tag
from homeostat.domain.plant.tag import Role as TagRole
from homeostat.domain.ports import GuardEvent
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy, Step
from homeostat.domain.request import Request, Seal
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.requests.seal import Sealer
from homeostat.guard.settings import GuardSettings
from homeostat.stl.formula import parse

TAGS = {
    tag.name: tag
    for tag in (
        Tag("T", TagRole.PV, "K", Range(270.0, 380.0), 1.0),
        Tag("Tx", TagRole.PV, "K", Range(270.0, 380.0), 1.0),
        Tag("L", TagRole.PV, "L", Range(-2.0, 14.0), 0.2),
        Tag("T.sp", TagRole.SP, "K", Range(296.0, 313.0), 1.0, rate_limit=0.5),
        Tag("F.sp", TagRole.SP, "L/s", Range(0.0, 0.05), 0.001, rate_limit=0.005),
        Tag("V.man", TagRole.MV, "1", Range(0.0, 1.0), 0.05, rate_limit=0.2),
        Tag("X.cmd", TagRole.MV, "1", Range(0.0, 1.0), 1.0),
    )
}


def limit(name: str, kind: LimitKind, text: str, hard: bool = False) -> Limit:
    """A limit over the vessel's tags."""
    return Limit(name, kind, parse(text, TAGS), hard, "Test document 1", f"What {name} protects")


HOT = limit("LIM-HOT", LimitKind.TRIP_LIMIT, "T <= 313", hard=True)
FULL = limit("LIM-FULL", LimitKind.TRIP_LIMIT, "L <= 12", hard=True)
FEED = limit("PRM-FEED", LimitKind.PERMISSIVE, "F.sp <= 0.001 or L <= 11")
OPEN = limit("PRM-OPEN", LimitKind.PERMISSIVE, "X.cmd >= 0.5 or F.sp <= 0.001")
LIMITS = Limits((HOT, FULL, FEED, OPEN), ())


def state(
    name: str, *ranges: SetpointRange, initial: bool = False, target: bool = False, settled: str = "true"
) -> State:
    """A state of the vessel."""
    return State(name, name.capitalize(), 0, initial, target, parse(settled, TAGS), frozenset(), ranges)


def awaited(name: str, source: str, target: str, guard: str) -> Transition:
    """A transition that is taken as soon as its guard holds."""
    return Transition(name, source, target, "", parse(guard, TAGS), on_decision=False)


def decided(name: str, source: str, target: str, guard: str = "true", event: str = "fault_diagnosed") -> Transition:
    """A transition that somebody decides on."""
    return Transition(name, source, target, event, parse(guard, TAGS))


STATES = (
    state(
        "waiting", SetpointRange("T.sp", 310.0, 310.0, 310.0), SetpointRange("F.sp", 0.0, 0.05, 0.0),
        SetpointRange("X.cmd", 1.0, 1.0, 1.0), SetpointRange("V.man", 0.0, 1.0, None), initial=True,
    ),
    state(
        "running", SetpointRange("T.sp", 298.0, 312.0, 310.0), SetpointRange("F.sp", 0.0, 0.05, 0.03),
        SetpointRange("V.man", 0.0, 1.0, None), SetpointRange("X.cmd", 1.0, 1.0, 1.0), target=True,
    ),
    state("emptying", SetpointRange("F.sp", 0.0, 0.01, 0.0), SetpointRange("V.man", 0.0, 1.0, 1.0), target=True),
    state("rest", SetpointRange("F.sp", 0.0, 0.0, 0.0), target=True, settled="F.sp <= 0.001"),
    state(
        "shut", SetpointRange("F.sp", 0.0, 0.0, 0.0), SetpointRange("X.cmd", 0.0, 0.0, 0.0),
        SetpointRange("V.man", 0.0, 1.0, 1.0), settled="F.sp <= 0.001",
    ),
)  # fmt: skip
MACHINE = StateMachine(
    "vessel", STATES,
    (
        awaited("start", "waiting", "running", "L >= 5"),
        decided("adjust", "running", "running", "T <= 320"),
        awaited("empty", "running", "emptying", "L >= 9"),
        awaited("end", "emptying", "rest", "L <= 1"),
        decided("trip", "running", "shut", event="trip"),
        decided("restart", "shut", "waiting", "T <= 311", event="restart"),
    ),
)  # fmt: skip
BEGIN = Step(MACHINE.transitions[0], (Command("F.sp", 0.03, 0.005),))
POUR = Step(MACHINE.transitions[2], (Command("F.sp", 0.0, 0.005), Command("V.man", 1.0, 0.2)))
DRAIN = FallbackStrategy(
    "drain",
    ActionSet((Command("X.cmd", 0.0, None), Command("F.sp", 0.0, 0.005), Command("V.man", 1.0, 0.2)), "shut"),
    forced=frozenset({"X.cmd"}),
)
CLOSE = FallbackStrategy("close", ActionSet((Command("X.cmd", 0.0, None), Command("F.sp", 0.0, 0.005)), "shut"))

QUALITIES = {
    "T": QualityRule("T", 5.0, noise=0.5, frozen_s=10.0, fastest=0.5, grace_s=5.0),
    "Tx": QualityRule("Tx", 5.0),
    "L": QualityRule("L", 5.0),
}
TRIPS = {
    "LIM-HOT": TripRule("LIM-HOT", 8.0, 6.0, parse("Tx <= 311.5", TAGS), lift=10.0, lift_s=60.0),
    "LIM-FULL": TripRule("LIM-FULL", 0.5, 6.0),
}
WRITABLES = {
    "T.sp": WriteRule("T.sp", 0.05, 2.0),
    "F.sp": WriteRule("F.sp", 0.0005, 2.0),
    "V.man": WriteRule("V.man", 0.005, 2.0, automatic=True),
    "X.cmd": WriteRule("X.cmd", 0.01, 2.0),
}
RULES = GuardRules(
    "vessel", TAGS, MACHINE, LIMITS, TRIPS, QUALITIES, WRITABLES, (DRAIN, CLOSE), (BEGIN,),
    StartUp(frozenset({"waiting"}), {"LIM-HOT": limit("LIM-HOT", LimitKind.TRIP_LIMIT, "T <= 350", hard=True)}),
    configuration="configuration-1",
)  # fmt: skip
KEY = b"k" * 32
PATIENT = GuardSettings(sync_s=5.0)
"""A busy machine decides nothing; tests of journals that hang have settings of their own."""
VALUES = {"T": 305.0, "Tx": 305.0, "L": 8.0}


@dataclass(slots=True)
class Answer:
    """A ticket of the vessel's link."""

    done: bool = True
    error: str = ""


class Vessel:
    """The vessel's link: a lease, a wire, targets that it accepts, and every way of not doing so."""

    never_blocks = True

    def __init__(self, **accepted: float | None) -> None:
        self.accepted: dict[str, float | None] = {"T.sp": 310.0, "F.sp": 0.0, "V.man": None, "X.cmd": 1.0}
        self.accepted.update({name.replace("_", "."): value for name, value in accepted.items()})
        self.values = dict(VALUES)
        self.now_s = 0.0
        self.wire: list[tuple[float, tuple[Command, ...]]] = []
        self.beats: list[float] = []
        self.leases = self.given_back = 0
        self.hangs = self.raises = self.ignores = self.errors = self.silent = False
        self.accepts_first = 100
        self.wiggle = 0.1

    def sample(self) -> Snapshot:
        """The next sample; readings move a little, as instruments do."""
        self.now_s += 1.0
        values = {tag: value + self.wiggle * math.sin(7.0 * self.now_s) for tag, value in self.values.items()}
        targets = {tag: math.nan if target is None else target for tag, target in self.accepted.items()}
        return Snapshot(self.now_s, values | targets, accepted=dict(self.accepted))

    def take(self) -> Vessel:
        self.leases += 1
        return self

    def beat(self) -> None:
        self.beats.append(self.now_s)

    def give_back(self) -> None:
        self.given_back += 1

    def send(self, commands: tuple[Command, ...]) -> Answer:
        self.wire.append((self.now_s, commands))
        if self.raises:
            raise ConnectionError("the control system does not answer")
        if self.hangs:
            return Answer(done=False)
        if not self.ignores:
            self.accepted.update({c.tag: c.value for c in commands[: self.accepts_first]})
        return Answer(done=not self.silent, error="half of it was refused" if self.errors else "")


@dataclass
class Journal:
    """A record in memory that can be told to fail."""

    events: list[tuple[GuardEvent, float]] = field(default_factory=list)
    syncs: int = 0
    error: Exception | None = None

    def record(self, event: GuardEvent, at_s: float) -> None:
        if self.error is not None:
            raise self.error
        self.events.append((event, at_s))

    def sync(self) -> None:
        if self.error is not None:
            raise self.error
        self.syncs += 1

    def of(self, kind: type) -> list[Any]:
        return [event for event, _ in self.events if isinstance(event, kind)]

    @property
    def kinds(self) -> list[str]:
        return [event.kind for event, _ in self.events]


PATIENT = GuardSettings(sync_s=5.0)
"""A busy machine must not look like a journal that hangs."""


class World:
    """A guard attached to a vessel, ticked once per second."""

    def __init__(
        self, mode: Mode = Mode.CLOSED_LOOP, rules: GuardRules = RULES, settings: GuardSettings | None = None,
        vessel: Vessel | None = None, **rest: Any,
    ) -> None:  # fmt: skip
        self.vessel, self.journal = vessel or Vessel(), Journal()
        rest.setdefault("lease", self.vessel)
        self.journal = rest.pop("record", self.journal)
        attachment = Attachment(self.journal, mode=mode, keys={"check": KEY}, **rest)
        self.guard = Guard(rules, attachment, settings or PATIENT)
        self.seen: list[Observation] = []

    def tick(self, times: int = 1, **values: float) -> Observation:
        """Let so many seconds pass, with some readings changed for good."""
        self.vessel.values.update(values)
        for _ in range(times):
            sample = self.vessel.sample()
            self.seen.append(self.guard.tick(sample.at_s, sample))
        return self.seen[-1]

    def silent(self, times: int = 1) -> Observation:
        """Let so many seconds pass without a sample."""
        for _ in range(times):
            self.vessel.now_s += 1.0
            self.seen.append(self.guard.tick(self.vessel.now_s, None))
        return self.seen[-1]

    def ask(self, request: Request | None = None, **changed: Any) -> Request:
        """Put a request into the mailbox."""
        asked = request or self.request(**changed)
        self.guard.mailbox.put(asked)
        return asked

    def request(self, name: str = "r1", actions: ActionSet | None = None, **changed: Any) -> Request:
        """A request that is sealed now."""
        plain = Request(
            name, "search", "running", actions or ADJUSTED, ("adjust",), "d1", RULES.configuration,
            Seal("", 0.0, 0.0, "", ""),
        )  # fmt: skip
        return Sealer("check", KEY).seal(replace(plain, **changed), self.vessel.now_s)

    def order(self, verb: Verb, subject: str = "", role: Role = Role.ENGINEER, **rest: str) -> None:
        """A person orders something."""
        number = f"o{len(self.journal.events)}-{len(self.seen)}-{verb}-{subject}-{rest.get('person', '')}"
        command = PersonCommand(number, rest.pop("person", "Ada"), role, verb, subject, **rest)
        self.guard.mailbox.put(command)

    @property
    def sent(self) -> list[tuple[Command, ...]]:
        """What arrived on the plant's wire, in order."""
        return [commands for _, commands in self.vessel.wire]

    @property
    def alarms(self) -> set[str]:
        """Alarms whose condition lasts."""
        return {a.id for a in self.guard.alarms if a.returned_s is None}


ADJUSTED = ActionSet((Command("T.sp", 305.0, 0.5), Command("F.sp", 0.02, 0.005)), "running")
ROUTE = ActionSet(ADJUSTED.commands, "running", (POUR,))


def running(**rest: Any) -> World:
    """A world whose vessel runs: start-up is over, and nothing is under way."""
    world = World(**rest)
    world.tick(4)
    world.vessel.wire.clear()
    return world


def statuses(world: World, name: str = "r1") -> list[str]:
    """Every answer to a request, in order."""
    return [a.status.value for seen in world.seen for a in seen.answers if a.request == name]


def finding(world: World, name: str = "r1") -> str:
    """Name of the check that refused a request; empty where none did."""
    found = [a.finding.criterion for seen in world.seen for a in seen.answers if a.request == name and a.finding]
    return found[-1] if found else ""


Changes = Mapping[str, float]
