"""Killed at any moment and started again: nothing repeated whose effect was known, nothing half done unnoticed."""

from __future__ import annotations

import itertools
import random
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from homeostat.domain.events.people import AlarmRaised, ServiceChanged
from homeostat.domain.events.trips import FallbackStands, LatchReset
from homeostat.domain.events.writes import Cause, ReadBack, WriteIntended
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import FallBack
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.ports import GuardEvent
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from homeostat.journal.encode import encode_fields
from tests.guard.vessel import KEY, ROUTE, RULES, Vessel, World

KILLS = 300
SETTINGS = GuardSettings(sync_s=1.0)


class Killed(BaseException):
    """The process dies here."""


@dataclass(frozen=True)
class Line:
    """One event as a journal holds it."""

    kind: str
    fields: dict[str, Any]
    event: GuardEvent


@dataclass
class Death:
    """Counts the instants at which a process may die, and says at which one it does."""

    at: int
    instants: int = 0
    dead: bool = False
    place: str = ""

    def instant(self, place: str) -> None:
        """The process may die here; once it is dead nothing that it does has an effect any more."""
        self.instants += 1
        if self.instants == self.at:
            self.dead, self.place = True, place
        if self.dead:
            raise Killed


@dataclass
class Disk:
    """What survives: lines in order, and how many of them are synced."""

    lines: list[Line] = field(default_factory=list)
    synced: int = 0

    def cut(self, keep_unsynced: bool) -> None:
        """What a power cut leaves, or with ``keep_unsynced`` the death of a process only."""
        if not keep_unsynced:
            del self.lines[self.synced :]

    def of(self, kind: type) -> list[Any]:
        return [line.event for line in self.lines if isinstance(line.event, kind)]


class DeadlyRecord:
    """A record whose process may die around every append and inside a sync."""

    def __init__(self, disk: Disk, death: Death) -> None:
        self._disk, self._death = disk, death

    def record(self, event: GuardEvent, at_s: float) -> None:
        self._death.instant(f"before {event.kind}")
        self._disk.lines.append(Line(event.kind, encode_fields(event, event.kind), event))
        self._death.instant(f"after {event.kind}")

    def sync(self) -> None:
        self._death.instant("before sync")
        self._disk.synced = len(self._disk.lines)
        self._death.instant("after sync")


class DeadlyPlant:
    """The way to a plant that outlives the guard; the guard may die before, inside and after a write."""

    never_blocks = True

    def __init__(self, vessel: Vessel, death: Death) -> None:
        self._vessel, self._death = vessel, death

    def take(self) -> DeadlyPlant:
        self._death.instant("take")
        self._vessel.take()
        return self

    def beat(self) -> None:
        self._death.instant("beat")
        self._vessel.beat()

    def give_back(self) -> None:
        self._death.instant("give back")
        self._vessel.give_back()

    def send(self, commands: tuple[Command, ...]) -> Any:
        self._death.instant("before send")
        if self._death.instants + 1 == self._death.at:
            half = commands[: (len(commands) + 1) // 2]
            self._vessel.send(half)
        self._death.instant("inside send")
        answer = self._vessel.send(commands)
        self._death.instant("after send")
        return answer


class Life:
    """One plant, its journal, and the guards that live and die beside it."""

    def __init__(self, vessel: Vessel, keep_unsynced: bool, rules: GuardRules = RULES) -> None:
        self.vessel, self.disk, self.rules = vessel, Disk(), rules
        self.keep_unsynced = keep_unsynced
        self.deaths = 0
        self.begin(Death(0))

    def begin(self, death: Death) -> None:
        """A new guard on the same plant, with what the journal says."""
        self.death = death
        plant = DeadlyPlant(self.vessel, death)
        memory = Memory.of(self.disk.lines) if self.deaths else None
        attachment = Attachment(DeadlyRecord(self.disk, death), plant, Mode.CLOSED_LOOP, {"check": KEY}, memory=memory)
        self.guard = Guard(self.rules, attachment, SETTINGS)
        self.began_at = len(self.disk.lines)

    def tick(self, sample: Snapshot) -> bool:
        """One tick; False where the guard has died in it."""
        try:
            self.death.instant("between ticks")
            self.guard.tick(sample.at_s, sample)
            if self.death.dead:  # the record's thread has died
                raise Killed
        except Killed:
            self.deaths += 1
            self.guard._parts.recorder.close()
            self.disk.cut(self.keep_unsynced)
            return False
        return True


Scene = Callable[[Life, int], None]
"""What happens to plant and guard before tick ``n``."""


def ask(life: Life, name: str, **changed: Any) -> None:
    world = World.__new__(World)
    world.vessel = life.vessel
    life.guard.mailbox.put(World.request(world, name, **changed))


def batch(life: Life, n: int) -> None:
    """Nominal start, a route by request, its later step, then a trip."""
    if n == 6:
        ask(life, "r1", actions=ROUTE, path=("adjust", "empty"))
    if n == 12:
        life.vessel.values["L"] = 9.5
    if n == 18:
        life.vessel.values["L"] = 13.0


def tripped(life: Life, n: int) -> None:
    """A request on the wire when a limit is violated."""
    if n in (6, 7):
        ask(life, f"r{n}")
    if n == 7:
        life.vessel.values["L"] = 13.0


def handled(life: Life, n: int) -> None:
    """People: a setpoint moved by hand, an order, a fallback, a reset and the way back."""
    if n == 5:
        life.vessel.accepted["T.sp"] = 300.0
    if n == 9:
        life.guard.mailbox.put(FallBack("recovery has nothing to release"))
    if n == 16:
        life.guard.mailbox.put(PersonCommand("o1", "Ada", Role.ENGINEER, Verb.RESET, reason="seen"))
    if n == 20:
        life.guard.mailbox.put(PersonCommand("o2", "Ada", Role.ENGINEER, Verb.MODE, "closed-loop"))


def deaf(life: Life, n: int) -> None:
    """The plant takes half of a fallback and obeys later."""
    life.vessel.accepts_first = 1 if 8 <= n < 14 else 100
    if n == 8:
        life.vessel.values["L"] = 13.0


def waits(life: Life, n: int) -> None:
    """A step waits, and what it waits for comes with a violated limit."""
    if n == 6:
        ask(life, "r1", actions=ROUTE, path=("adjust", "empty"))
    if n == 11:
        life.vessel.values["L"] = 13.0


def late(life: Life, n: int) -> None:
    """A request hangs on the wire, a limit is violated, and what hung arrives after the fallback."""
    life.vessel.hangs = n in (6, 7)
    if n == 6:
        ask(life, "r1", actions=ROUTE, path=("adjust", "empty"))
    if n == 8:
        life.vessel.values["L"] = 13.0
    if n == 13 and any(c == ROUTE.commands for _, c in life.vessel.wire):
        life.vessel.accepted.update({c.tag: c.value for c in ROUTE.commands})


def silent(life: Life, n: int) -> None:
    """A link that obeys and never says so: everything is known by reading alone."""
    life.vessel.silent = True
    batch(life, n)


SCENES: dict[str, Scene] = {
    "batch": batch, "tripped": tripped, "handled": handled, "deaf": deaf, "waits": waits, "late": late,
    "silent": silent,
}  # fmt: skip
TICKS = 30
SETTLES = 12
"""Ticks after a death until everything must be in order."""


def live(scene: Scene, death: Death, keep_unsynced: bool, second: Death | None = None) -> Life:
    """The scene from beginning to end, with a guard that dies once, and perhaps again as it restarts."""
    life = Life(Vessel(), keep_unsynced)
    life.death = death
    plant, record = life.guard._parts.tenure._lease, life.guard._parts.recorder._record
    plant._death = record._death = death  # type: ignore[union-attr, attr-defined]
    later = [second] if second else []
    n, until = 0, TICKS
    while n < until:
        scene(life, n)
        if not life.tick(life.vessel.sample()):
            life.begin(later.pop() if later else Death(0))
            until = max(until, n + 1 + SETTLES)
        n += 1
    life.death.at = 0
    life.guard.stop("the test is over")
    return life


def verdict(life: Life, quiet: Life) -> list[str]:
    """What is wrong with a life that was interrupted, compared with one that was not."""
    wrong = []
    lines = life.disk.lines
    confirmed: set[int] = set()
    done: set[tuple[Cause, str]] = set()
    names: dict[int, tuple[Cause, str]] = {}
    numbers: list[int] = []
    half: set[int] = set()
    for line in lines:
        event = line.event
        if isinstance(event, ReadBack):
            if not event.deviating:
                confirmed.add(event.write)
                done.add(names[event.write])
            half |= {event.write} if event.deviating else set()
        if isinstance(event, WriteIntended):
            names[event.write] = (event.cause, event.source)
            if event.cause in (Cause.SEQUENCE, Cause.REQUEST) and names[event.write] in done:
                wrong.append(f"{event.source!r} was sent again although it was read back")
            if event.write in confirmed:
                wrong.append(f"write {event.write} was sent again although it was read back")
            if numbers and event.write < numbers[-1]:
                wrong.append(f"write {event.write} after {numbers[-1]}")
            numbers.append(event.write)
    last = {e.write: e for e in life.disk.of(WriteIntended)}
    known = confirmed | half
    wrong += [f"nobody says what became of write {n}" for n in last if n not in known]
    wrong += [f"guard: {e.alarm} {e.cause}" for e in life.disk.of(AlarmRaised) if e.alarm.startswith("guard:")]
    after = list(itertools.dropwhile(lambda e: e.cause is not Cause.FALLBACK, life.disk.of(WriteIntended)))
    if not life.disk.of(LatchReset):
        wrong += [f"{e.source!r} was sent after the fallback" for e in after if e.cause is not Cause.FALLBACK]
    resets = len(life.disk.of(LatchReset)) + len(quiet.disk.of(LatchReset))  # the order may have died with the guard
    if any(w.cause is Cause.FALLBACK for w in last.values()) and not resets:
        if life.guard.latched is None:
            wrong.append("a fallback had begun, and nothing is latched")
        if not life.disk.of(FallbackStands) and not any(cause is Cause.FALLBACK for cause, _ in done):
            wrong.append("the fallback is not confirmed")
    if life.guard.latched is not None and not life.disk.of(WriteIntended):
        wrong.append("latched without a write")
    if (life.guard.latched is None) is not (quiet.guard.latched is None) and not resets:
        wrong.append(f"latched {life.guard.latched!r} instead of {quiet.guard.latched!r}")
    if life.guard.latched is None and life.guard._parts.sequencer.state != quiet.guard._parts.sequencer.state:
        wrong.append(f"in {life.guard._parts.sequencer.state!r} instead of {quiet.guard._parts.sequencer.state!r}")
    served = {e.tag: e.in_service for e in life.disk.of(ServiceChanged)}
    if life.guard.out_of_service != {tag for tag, into in served.items() if not into}:
        wrong.append(f"out of service are {sorted(life.guard.out_of_service)}, the journal says {served}")
    for n, commands in enumerate(sent := [c for _, c in life.vessel.wire]):
        intended = sum(e.commands[: len(commands)] == commands for e in life.disk.of(WriteIntended))
        arrived = sum(c == commands for c in sent[: n + 1])
        if arrived > intended:
            wrong.append(f"{commands} arrived {arrived} times and were intended {intended} times")
    if life.guard.latched is not None and life.vessel.accepted["X.cmd"] != 0.0:
        wrong.append("latched with an open valve")
    return wrong


def lost(life: Life, name: str) -> bool:
    """Whether the death swallowed what was asked before anything was written for it: its issuer asks again."""
    causes = {e.cause for e in life.disk.of(WriteIntended)}
    return (Cause.FALLBACK if name == "handled" else Cause.REQUEST) not in causes


def kill(seed: int) -> tuple[str, list[str]]:
    """One killed life: where it died and what is wrong with what followed."""
    draw = random.Random(seed)
    name = draw.choice(list(SCENES))
    keep = draw.random() < 0.5
    quiet = live(SCENES[name], Death(0), keep)
    instants = quiet.death.instants
    death = Death(draw.randint(1, instants))
    second = Death(draw.randint(1, 25)) if draw.random() < 0.4 else None
    life = live(SCENES[name], death, keep, second)
    wrong = verdict(life, quiet)
    if lost(life, name):
        wrong = [w for w in wrong if not w.startswith("in ")]
    again = "" if second is None else f" and {second.place!r} (instant {second.at})"
    return f"seed {seed}: {name}, {'all' if keep else 'synced'} lines, {death.place!r} ({death.at}){again}", wrong


def killed(count: int, first: int = 0) -> list[str]:
    """What is wrong after so many kills, a line each."""
    found = []
    for seed in range(first, first + count):
        where, wrong = kill(seed)
        found += [f"{where}: {w}" for w in wrong]
    return found


def test_nothing_is_lost_repeated_or_left_half_done_by_any_of_many_kills() -> None:
    before = threading.active_count()
    assert killed(KILLS) == []
    assert threading.active_count() <= before + 2


@pytest.mark.parametrize("name", SCENES)
def test_a_life_that_nobody_ends_is_as_it_should_be(name: str) -> None:
    life = live(SCENES[name], Death(0), True)
    assert verdict(life, life) == []
    assert life.disk.of(WriteIntended)
