"""A small heated vessel for attacks: four rules, two states, and rollouts made by hand."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from dataclasses import replace

import numpy as np

from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits, Owner
from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy, RecoveryPath, Step
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.stl.formula import parse

TAGS = {
    tag.name: tag
    for tag in (
        Tag("T", Role.PV, "K", Range(270.0, 380.0), 1.0),
        Tag("L", Role.PV, "L", Range(-2.0, 14.0), 0.2),
        Tag("F", Role.PV, "L/s", Range(0.0, 0.08), 0.001),
        Tag("T.sp", Role.SP, "K", Range(296.0, 313.0), 1.0, rate_limit=0.5),
        Tag("F.sp", Role.SP, "L/s", Range(0.0, 0.05), 0.001, rate_limit=0.005),
        Tag("L.sp", Role.SP, "L", Range(0.0, 12.0), 0.2),
        Tag("V.man", Role.MV, "1", Range(0.0, 1.0), 0.05, rate_limit=0.2),
    )
}


def rule(name: str, kind: LimitKind, text: str, hard: bool = False) -> Limit:
    """A limit over the vessel's tags."""
    return Limit(name, kind, parse(text, TAGS), hard, "Test document 1", f"What {name} protects")


def criterion(name: str, text: str, hard: bool = False, owner: Owner = Owner.ACTION) -> Criterion:
    """An acceptance criterion over the vessel's tags."""
    return Criterion(name, owner, parse(text, TAGS), hard, "Test document 2", f"What {name} asks for")


HOT = rule("LIM-HOT", LimitKind.TRIP_LIMIT, "T <= 313", hard=True)
COLD = rule("LIM-COLD", LimitKind.ENVELOPE, "T >= 298")
FEED = rule("PRM-FEED", LimitKind.PERMISSIVE, "L <= 11")
CALM = criterion("ACC-CALM", "always (T <= 312.9)", hard=True)
LIMITS = Limits((HOT, COLD, FEED), (CALM,))
NO_LIMITS = Limits((), ())

RUNNING = State(
    "running", "Running", 1, False, True, parse("F.sp >= 0.01", TAGS), frozenset(),
    (
        SetpointRange("T.sp", 298.0, 312.0, 310.0),
        SetpointRange("F.sp", 0.0, 0.05, 0.03),
        SetpointRange("V.man", 0.0, 1.0, None),
        SetpointRange("L.sp", 0.0, 12.0, 10.0),
    ),
)  # fmt: skip
STILL = State("still", "Still", 3, False, True, parse("F.sp <= 0.001", TAGS), frozenset(), ())
WAITING = State("waiting", "Waiting", 0, True, False, parse("true", TAGS), frozenset(), ())
EMPTYING = State(
    "emptying", "Emptying", 2, False, True, parse("F.sp <= 0.01", TAGS), frozenset(),
    (SetpointRange("F.sp", 0.0, 0.01, 0.0), SetpointRange("V.man", 0.0, 1.0, 1.0)),
)  # fmt: skip

GOOD = {"T": 305.0, "L": 8.0, "F": 0.03, "T.sp": 310.0, "F.sp": 0.03, "L.sp": 10.0, "V.man": float("nan")}
"""Readings that keep every rule."""
ACTIONS = ActionSet((Command("T.sp", 305.0, 0.5), Command("F.sp", 0.02, 0.005)), "running")
DRAIN = FallbackStrategy("drain", ActionSet((Command("F.sp", 0.0, None), Command("V.man", 1.0, None)), "still"))
VENT = FallbackStrategy("vent", ActionSet((Command("F.sp", 0.0, None),), "still"))


def awaited(name: str, source: str, target: str, guard: str) -> Transition:
    """A transition that is taken as soon as its guard holds."""
    return Transition(name, source, target, "", parse(guard, TAGS), on_decision=False)


ADJUST = Transition("adjust", "running", "running", "fault_diagnosed", parse("true", TAGS))
START = awaited("start", "waiting", "running", "L >= 5")
EMPTY = awaited("empty", "running", "emptying", "L >= 9 and T <= 310")
REST = awaited("rest", "emptying", "still", "L <= 1")
MACHINE = StateMachine("vessel", (WAITING, RUNNING, EMPTYING, STILL), (ADJUST, START, EMPTY, REST))
"""Waiting, running, emptying and still, one after the other."""
ROUTE = RecoveryPath(MACHINE, (ADJUST, EMPTY, REST))
POUR = Step(EMPTY, (Command("F.sp", 0.0, 0.005), Command("V.man", 1.0, 0.2)))
END = Step(REST, ())
BATCH = replace(ACTIONS, then=(POUR, END))
"""New setpoints now, then empty the vessel when it is full, then rest."""

MEMBERS, SAMPLES = 3, 12


def reading(at_s: float = 100.0, bad: frozenset[str] = frozenset(), **changed: float) -> Snapshot:
    """A snapshot of a healthy vessel with some readings changed; ``T_sp=1`` stands for the tag ``T.sp``."""
    return Snapshot(at_s, GOOD | {tag.replace("_", "."): value for tag, value in changed.items()}, bad)


def rollout(actions: ActionSet = ACTIONS, at: tuple[int, int] = (0, 0), dt_s: float = 5.0, **changed: float) -> Rollout:
    """A rollout that keeps every rule but for the values ``changed``, which one member has at one sample."""
    signals = {tag: np.full((MEMBERS, SAMPLES), value) for tag, value in GOOD.items()}
    for tag, value in changed.items():
        signals[tag.replace("_", ".")][at] = value
    weights = (1.0 / MEMBERS,) * MEMBERS
    return Rollout(actions.digest, Trajectory(0.0, dt_s, signals), (), weights, RolloutResult.COMPLETED)


def broken_down(actions: ActionSet = ACTIONS, note: str = "member 2 at t = 7 s") -> Rollout:
    """A rollout in which the twin left the physical world."""
    return replace(rollout(actions), result=RolloutResult.BROKE_DOWN, trajectory=Trajectory(0.0, 1.0, {}), note=note)


class Bench:
    """Implements the plant's port in memory: gives prepared snapshots and remembers what was written."""

    def __init__(self, *snapshots: Snapshot, reachable: bool = True) -> None:
        self._snapshots = snapshots or (reading(),)
        self._reachable = reachable
        self.written: list[tuple[Command, ...]] = []

    async def snapshots(self) -> AsyncIterator[Snapshot]:
        for snapshot in self._snapshots:
            yield snapshot

    async def since(self, at_s: float) -> tuple[Snapshot, ...]:
        return tuple(s for s in self._snapshots if s.at_s > at_s) or self._snapshots[-1:]

    async def write(self, commands: tuple[Command, ...]) -> None:
        if not self._reachable:
            raise ConnectionError("the control system does not answer")
        self.written.append(commands)

    @property
    def state(self) -> Mapping[str, float | None]:
        """Tag -> what was last commanded."""
        return {command.tag: command.value for commands in self.written for command in commands}


def sequencer(limits: Limits = LIMITS, *nominal: Step) -> Sequencer:
    """The vessel's sequencer; ``nominal`` is what follows by itself."""
    return Sequencer(MACHINE, limits, nominal)


def command(tag: str, value: float | None, rate: float | None = None) -> Command:
    """A command; a rate where the tag has a limit and none is given."""
    allowed = TAGS[tag].rate_limit if tag in TAGS else None
    return Command(tag, value, allowed if rate is None and value is not None else rate)
