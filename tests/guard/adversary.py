"""Random and adversarial requests straight to a guard, and an oracle that knows the tables but not the guard.

:func:`attack` works with the rules of any plant: ``benchmarks`` runs it with those of the shipped ones.
"""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.ports import GuardEvent
from homeostat.domain.recovery import Command
from homeostat.domain.request import Request, RequestStatus
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from tests.guard.oracle import KEY, OLDEST_S, Oracle
from tests.guard.spoils import Maker, forged

Readings = Callable[[float], Mapping[str, float]]
"""Time [s] -> reading of every measured tag; the targets of writable tags are added."""


class Silent:
    """A record that keeps nothing."""

    def record(self, event: GuardEvent, at_s: float) -> None:
        pass

    def sync(self) -> None:
        pass


@dataclass(frozen=True)
class Done:
    done: bool = True
    error: str = ""


class Obedient:
    """A plant that takes every command as it comes."""

    never_blocks = True

    def __init__(self, accepted: Mapping[str, float | None]) -> None:
        self.accepted = dict(accepted)
        self.sent: list[tuple[Command, ...]] = []

    def take(self) -> Obedient:
        return self

    def beat(self) -> None:
        pass

    def give_back(self) -> None:
        pass

    def send(self, commands: tuple[Command, ...]) -> Done:
        self.sent.append(commands)
        self.accepted.update({c.tag: c.value for c in commands})
        return Done()


@dataclass
class Report:
    """What became of the requests."""

    asked: int = 0
    accepted: int = 0
    wrongly: list[str] = field(default_factory=list)
    unanswered: list[str] = field(default_factory=list)
    altered: list[str] = field(default_factory=list)
    refusals: Counter[str] = field(default_factory=Counter)

    def __str__(self) -> str:
        rows = [f"{'refused by':<28}{'requests':>9}", *(f"{n:<28}{k:>9}" for n, k in self.refusals.most_common())]
        head = (
            f"{self.asked} requests, {self.accepted} accepted, {len(self.wrongly)} of them although they break a check"
        )
        return "\n".join([head, *rows])


class Bench:
    """A guard in a writing mode on an obedient plant, with the oracle beside it."""

    def __init__(self, rules: GuardRules, readings: Readings, state: str, accepted: Mapping[str, float | None]) -> None:
        self.rules, self.readings, self.first = rules, readings, state
        self.plant, self.now_s = Obedient(accepted), 0.0
        self.accepted = dict(accepted)
        self.oracle, self.report = Oracle(rules), Report()
        self.fresh: list[Any] = []
        self.waiting: dict[str, list[Any]] = {}
        self.expected: tuple[Command, ...] = ()
        self.values: dict[str, float] = {}
        self.begin()

    def begin(self) -> None:
        """A new guard in the first state, with the plant as it was then."""
        self.state, self.plant.accepted = self.first, dict(self.accepted)
        memory = Memory(state=self.first, waiting=(), writes=len(self.plant.sent))
        attachment = Attachment(Silent(), self.plant, Mode.CLOSED_LOOP, {"check": KEY}, memory=memory)
        self.guard = Guard(self.rules, attachment, GuardSettings(sync_s=5.0))
        self.tick()

    def end(self) -> None:
        """Let everything that was asked be answered."""
        for _ in range(int(OLDEST_S) + 5):
            self.tick()
        self.report.unanswered += [name for name, asked in self.waiting.items() if asked]
        self.guard.stop("the attack is over")

    @property
    def stuck(self) -> bool:
        """Whether no decision leads on from here, or nothing is released any more."""
        onward = [t for t in self.rules.machine.transitions if t.source == self.state and t.on_decision]
        return self.guard.latched is not None or not any(
            self.rules.machine.state(t.target).recovery_target for t in onward
        )

    def tick(self) -> None:
        """One second; what the guard says is judged."""
        self.now_s += 1.0
        targets = {t: math.nan if v is None else v for t, v in self.plant.accepted.items()}
        self.values = dict(self.readings(self.now_s)) | targets
        for request in self.fresh:
            self.waiting.setdefault(str(getattr(request, "id", ""))[:100], []).append(_kept(request))
        self.fresh.clear()
        before, sent = self.state, len(self.plant.sent)
        seen = self.guard.tick(self.now_s, Snapshot(self.now_s, dict(self.values), accepted=dict(self.plant.accepted)))
        for answer in seen.answers:
            self._answered(answer.request, answer.status, answer.finding, before)
        self._unaltered(self.plant.sent[sent:])
        self.state = seen.state

    def ask(self, request: Any) -> None:
        """Put a request into the mailbox."""
        self.report.asked += 1
        self.guard.mailbox.put(request)
        self.fresh.append(request)

    def _answered(self, name: str, status: RequestStatus, finding: Any, state: str) -> None:
        asked = self.waiting.get(name) or [None]
        request = asked[-1 if finding is not None and finding.criterion == "CHK-USED" else 0]
        if status is RequestStatus.ACCEPTED:
            self.report.accepted += 1
            wrong = self.oracle.broken(request, self.now_s, self.values, state, self.guard.out_of_service)
            if wrong:
                self.report.wrongly.append(f"{name} at {self.now_s:g} s: {', '.join(sorted(wrong))}")
            self.oracle.seen |= {request.id, request.seal.nonce}
            self.expected = request.actions.commands
        if status is RequestStatus.REFUSED:
            self.report.refusals[finding.criterion] += 1
        if status.final:
            self.waiting[name] = [r for r in asked if r is not request]

    def _unaltered(self, sent: list[tuple[Command, ...]]) -> None:
        for commands in sent:
            if commands is self.expected or any(a is b for a in commands for b in self.expected):
                self.report.altered.append("the plant was sent the objects of a stranger")


def attack(
    rules: GuardRules, readings: Readings, state: str, accepted: Mapping[str, float | None], count: int, seed: int = 0
) -> Report:
    """Ask ``count`` times for something, mostly wrong; ``state`` is the one that the plant is in."""
    draw = random.Random(seed)
    bench, maker = Bench(rules, readings, state, accepted), Maker(rules, draw)
    while bench.report.asked < count:
        if bench.stuck:
            bench.end()
            bench.begin()
        batch = []
        for _ in range(draw.choice([1, 1, 1, 2, 3])):
            request: Any = maker.good(bench.state, bench.values, bench.now_s)
            for _ in range(draw.choice([0, 1, 1, 1, 2])):
                request = maker.spoiled(request, bench.now_s + 1.0) if isinstance(request, Request) else request
            bench.ask(request)
            batch.append(request)
        if draw.random() < 0.1:  # altered in the mailbox
            request = draw.choice(batch)
            _alter(request, "id" if draw.random() < 0.3 else "proposer", "somebody else")
        if draw.random() < 0.05:  # somebody at the plant moves a target
            tag = draw.choice(list(bench.plant.accepted))
            bench.plant.accepted[tag] = rules.tags[tag].range.clip((bench.plant.accepted[tag] or 0.0) + 0.37)
        bench.tick()
        for request in batch:  # altered during the write
            _alter(getattr(request, "actions", None), "commands", ())
        maker.old = [r for r in [*maker.old, *batch] if isinstance(r, Request)][-50:]
        bench.tick()
        if draw.random() < 0.1:
            for tag in bench.guard.out_of_service:
                name = f"o{bench.report.asked}-{tag}"
                bench.guard.mailbox.put(PersonCommand(name, "Ada", Role.OPERATOR, Verb.IN_SERVICE, tag))
    bench.end()
    return bench.report


def _kept(request: Any) -> Any:
    """``request`` as it is now, whatever somebody does to it later."""
    try:
        return forged(request, actions=forged(request.actions))
    except (AttributeError, TypeError):
        return request


def _alter(thing: Any, name: str, value: object) -> None:
    if hasattr(thing, name):
        object.__setattr__(thing, name, value)
