"""Random and adversarial requests straight to a guard, and an oracle that knows the tables but not the guard.

:func:`attack` works with the rules of any plant: ``benchmarks`` runs it with those of the shipped ones.
"""

from __future__ import annotations

import hashlib
import hmac
import itertools
import json
import math
import random
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from homeostat.domain.limits import LimitKind
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.ports import GuardEvent
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.request import Request, RequestStatus, Seal
from homeostat.domain.rules import GuardRules
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Attachment, Guard
from homeostat.guard.memory import Memory
from homeostat.guard.settings import GuardSettings

KEY = b"a key that proposers do not have"
OLDEST_S = 30.0
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


def sealed(request: Request, checked_s: float, lasts_s: float = 30.0, nonce: str | None = None) -> Request:
    """``request`` with a seal made by hand, so that the tests need no code of the guard for it."""
    name = nonce or f"nonce-{request.id}-{checked_s}"
    blank = replace(request, seal=Seal("check", checked_s, checked_s + lasts_s, name, ""))
    return replace(blank, seal=replace(blank.seal, mac=_mac(blank, KEY)))


def _mac(request: Request, key: bytes) -> str:
    seal = request.seal
    content = [
        request.id, request.proposer, request.state, _digest(request.actions), list(request.path), request.diagnosis,
        request.configuration, seal.issuer, seal.checked_s, seal.expires_s, seal.nonce,
    ]  # fmt: skip
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=True)
    return hmac.new(key, text.encode(), hashlib.sha256).hexdigest()


def _digest(actions: ActionSet) -> str:
    def texts(commands: tuple[Command, ...]) -> list[list[object]]:
        return [[c.tag, c.value, c.rate] for c in commands]

    content: list[object] = [actions.target, texts(actions.commands)]
    content += [
        [s.transition.name, str(s.transition.guard), s.transition.target, texts(s.commands)] for s in actions.then
    ]
    return hashlib.sha256(json.dumps(content, separators=(",", ":"), allow_nan=False).encode()).hexdigest()


@dataclass
class Oracle:
    """Says which checks a request breaks: from the tables, and nothing else."""

    rules: GuardRules
    seen: set[str] = field(default_factory=set)

    def broken(
        self, request: Any, now_s: float, values: Mapping[str, float], state: str, out: frozenset[str]
    ) -> set[str]:
        """Names of everything that is wrong with ``request`` at ``now_s`` [s]."""
        try:
            wrong = self._form(request)
            wrong |= set() if wrong else self._origin(request, now_s) | self._content(request, values, state, out)
        except Exception as error:  # what cannot even be looked at has no form
            return {f"form: {type(error).__name__}"}
        return wrong

    def _form(self, r: Request) -> set[str]:
        machine = {t.name: t for t in self.rules.machine.transitions}
        texts = (r.id, r.proposer, r.state, r.diagnosis, r.configuration, r.seal.issuer, r.seal.nonce, r.seal.mac)
        if not all(isinstance(t, str) for t in texts) or not isinstance(r.path, tuple) or not r.path:
            return {"form"}
        if any(name not in machine for name in r.path):
            return {"form"}
        path = [machine[name] for name in r.path]
        decided = len(list(itertools.takewhile(lambda t: t.on_decision, path)))
        joined = all(a.target == b.source for a, b in itertools.pairwise(path))
        alone = not any(t.on_decision for t in path[decided:])
        names = [s.transition.name for s in r.actions.then] == [t.name for t in path[decided:]]
        now = path[decided - 1].target if decided else path[0].source
        if not (joined and alone and names and r.actions.target == now):
            return {"form"}
        for part in (r.actions.commands, *(s.commands for s in r.actions.then)):
            if len({c.tag for c in part}) != len(part) or not all(map(_whole, part)):
                return {"form"}
        return set()

    def _origin(self, r: Request, now_s: float) -> set[str]:
        wrong = set()
        if r.seal.issuer != "check" or r.seal.mac != _mac(r, KEY):
            wrong.add("seal")
        if r.id in self.seen or r.seal.nonce in self.seen:
            wrong.add("used")
        if not (now_s - OLDEST_S <= r.seal.checked_s <= now_s):
            wrong.add("age")
        if not (r.seal.expires_s >= now_s and r.seal.expires_s <= r.seal.checked_s + OLDEST_S + 1e-6):
            wrong.add("expiry")
        return wrong

    def _content(self, r: Request, values: Mapping[str, float], state: str, out: frozenset[str]) -> set[str]:
        rules, wrong = self.rules, set[str]()
        machine = {t.name: t for t in rules.machine.transitions}
        path = [machine[name] for name in r.path]
        decisions = [t for t in path if t.on_decision]
        if not (r.actions.commands or r.actions.then):
            wrong.add("empty")
        if r.configuration != rules.configuration:
            wrong.add("configuration")
        if not (r.state == path[0].source == state):
            wrong.add("state")
        if not rules.machine.state(path[-1].target).recovery_target:
            wrong.add("target")
        known = {tag: v for tag, v in values.items() if math.isfinite(v)}
        if not all(t.guard.margin_at(known) >= 0.0 for t in decisions):
            wrong.add("open")
        for name, part in (
            (r.actions.target, r.actions.commands),
            *((s.transition.target, s.commands) for s in r.actions.then),
        ):
            for c in part:
                wrong |= self._command(c, name, out)
        after = {tag: v for tag, v in known.items() if tag not in {c.tag for c in r.actions.commands}}
        after |= {c.tag: c.value for c in r.actions.commands if c.value is not None}
        for limit in rules.limits.limits:
            if limit.kind is LimitKind.PERMISSIVE and not limit.formula.margin_at(after) >= 0.0:
                wrong.add("permissive")
            if limit.hard and not limit.formula.margin_at(known) >= 0.0:
                wrong.add("limit")
        return wrong

    def _command(self, c: Command, state: str, out: frozenset[str]) -> set[str]:
        ranges = {s.tag: s for s in self.rules.machine.state(state).setpoints}
        if c.tag not in self.rules.writables:
            return {"writable"}
        if c.tag not in ranges:
            return {"admissible"}
        admitted, rate_limit = ranges[c.tag], self.rules.tags[c.tag].rate_limit
        if c.value is None:
            ready = self.rules.writables[c.tag].automatic and admitted.design is None
            return ({"service"} if c.tag in out else set()) | (set() if ready else {"automatic"})
        wrong = {"service"} if c.tag in out else set()
        slack = 1e-6 * max(abs(admitted.low), abs(admitted.high), 1.0)
        if not admitted.low - slack <= c.value <= admitted.high + slack:
            wrong.add("range")
        if rate_limit is not None and (c.rate is None or c.rate > rate_limit):
            wrong.add("rate")
        return wrong


def _whole(c: Command) -> bool:
    numbers = [n for n in (c.value, c.rate) if n is not None]
    plain = all(isinstance(n, int | float) and not isinstance(n, bool) and math.isfinite(n) for n in numbers)
    return isinstance(c.tag, str) and plain and (c.rate is None or c.rate > 0.0)


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


class Maker:
    """Makes requests: good ones, and good ones that something was done to."""

    def __init__(self, rules: GuardRules, draw: random.Random) -> None:
        self._rules, self._draw = rules, draw
        self._count = 0
        self.old: list[Request] = []

    def good(self, state: str, values: Mapping[str, float], now_s: float) -> Request:
        """A request that ought to pass, as far as ranges and the machine tell."""
        draw, machine = self._draw, self._rules.machine
        starts = [t for t in machine.transitions if t.source == state and t.on_decision]
        open_ = [t for t in starts if machine.state(t.target).recovery_target and t.guard.holds(values)]
        path = [draw.choice(open_ or starts or list(machine.transitions))]
        while draw.random() < 0.5:
            onward = [t for t in machine.transitions if t.source == path[-1].target and not t.on_decision]
            if not onward:
                break
            path.append(draw.choice(onward))
        first, *later = path
        steps = tuple(Step(t, self._commands(t.target)) for t in later)
        self._count += 1
        plain = Request(
            f"r{self._count}", draw.choice(["search", "model"]), state,
            ActionSet(self._commands(first.target), first.target, steps), tuple(t.name for t in path), "d1",
            self._rules.configuration, Seal("", 0.0, 0.0, "", ""),
        )  # fmt: skip
        return sealed(plain, now_s - draw.choice([0.0, 0.0, 1.0, 5.0]), draw.choice([25.0, 30.0]))

    def _commands(self, state: str) -> tuple[Command, ...]:
        found = []
        for r in self._rules.machine.state(state).setpoints:
            rate = self._rules.tags[r.tag].rate_limit
            value = self._draw.choice([r.low, r.high, self._draw.uniform(r.low, r.high)])
            if self._draw.random() < 0.8:
                found.append(Command(r.tag, value, rate))
        self._draw.shuffle(found)
        return tuple(found)

    def spoiled(self, request: Request, now_s: float) -> Any:
        """``request`` with one thing done to it, mostly with a seal that covers it all the same."""
        kind, made = self._draw.choice(list(SPOILS.items()))
        try:
            changed = made(self, request, now_s)
        except (ValueError, IndexError, TypeError, AttributeError):
            return request
        if kind.startswith("sealed:") and isinstance(changed, Request):
            try:
                lasts_s = changed.seal.expires_s - changed.seal.checked_s
                return sealed(changed, changed.seal.checked_s, lasts_s)
            except (TypeError, ValueError, AttributeError):
                return changed
        return changed

    def one(self, items: tuple[Any, ...]) -> int:
        return self._draw.randrange(len(items))

    @property
    def draw(self) -> random.Random:
        return self._draw

    @property
    def rules(self) -> GuardRules:
        return self._rules


def forged(thing: Any, **fields: Any) -> Any:
    """A copy of a frozen record with fields that its constructor would not take."""
    copy = object.__new__(type(thing))
    for name in thing.__dataclass_fields__:
        object.__setattr__(copy, name, fields.get(name, getattr(thing, name)))
    return copy


def _command(m: Maker, r: Request, **fields: Any) -> Request:
    """``r`` with one command changed, at once or in a later step."""
    parts = [r.actions.commands, *(s.commands for s in r.actions.then)]
    part = m.one(tuple(parts))
    commands = list(parts[part])
    k = m.one(tuple(commands))
    commands[k] = forged(commands[k], **fields)
    if part == 0:
        return forged(r, actions=forged(r.actions, commands=tuple(commands)))
    then = list(r.actions.then)
    then[part - 1] = forged(then[part - 1], commands=tuple(commands))
    return forged(r, actions=forged(r.actions, then=tuple(then)))


def _far(m: Maker, r: Request) -> float:
    return m.draw.choice([-1e9, -1.0, -1e-3, 1e-3, 0.5, 2.0, 1e3, 1e9])


Spoil = Callable[[Maker, Request, float], Any]
SPOILS: dict[str, Spoil] = {
    "sealed: a value": lambda m, r, t: _command(m, r, value=m.draw.choice([_far(m, r), 0.0, 1.0])),
    "sealed: a small excess": lambda m, r, t: _command(m, r, value=(r.actions.commands[0].value or 0.0) + _far(m, r)),
    "sealed: no number": lambda m, r, t: _command(m, r, value=m.draw.choice([math.nan, math.inf, "1", True, [1]])),
    "sealed: a rate": lambda m, r, t: _command(m, r, rate=m.draw.choice([None, 0.0, -1.0, 1e6, math.nan, math.inf])),
    "sealed: automatic": lambda m, r, t: _command(m, r, value=None),
    "sealed: a tag": lambda m, r, t: _command(m, r, tag=m.draw.choice([*m.rules.tags, "", "Q9.sp", "t.sp"])),
    "sealed: another writable tag": lambda m, r, t: _command(m, r, tag=m.draw.choice(list(m.rules.writables))),
    "sealed: twice": lambda m, r, t: forged(r, actions=forged(r.actions, commands=r.actions.commands[:1] * 2)),
    "sealed: empty": lambda m, r, t: forged(r, actions=forged(r.actions, commands=(), then=())),
    "sealed: a state": lambda m, r, t: forged(r, state=m.draw.choice([s.name for s in m.rules.machine.states])),
    "sealed: a target": lambda m, r, t: forged(
        r, actions=forged(r.actions, target=m.draw.choice([s.name for s in m.rules.machine.states]))
    ),
    "sealed: a path": lambda m, r, t: forged(
        r, path=tuple(x.name for x in m.draw.sample(m.rules.machine.transitions, m.draw.randint(0, 3)))
    ),
    "sealed: no later steps": lambda m, r, t: forged(r, actions=forged(r.actions, then=())),
    "sealed: other steps": lambda m, r, t: forged(
        r, actions=forged(r.actions, then=tuple(Step(x, ()) for x in m.draw.sample(m.rules.machine.transitions, 2)))
    ),
    "sealed: a configuration": lambda m, r, t: forged(r, configuration="configuration-2"),
    "sealed: a list": lambda m, r, t: forged(r, actions=forged(r.actions, commands=list(r.actions.commands))),
    "sealed: an age": lambda m, r, t: forged(
        r,
        seal=forged(
            r.seal,
            checked_s=(at := m.draw.choice([t - 31.0, t - 1e6, t + 0.5, t + 1e6, math.nan, -math.inf])),
            expires_s=at + 30.0,
        ),
    ),
    "sealed: an expiry": lambda m, r, t: forged(
        r,
        seal=forged(r.seal, expires_s=m.draw.choice([t - 1.0, t + 31.0, r.seal.checked_s + 31.0, math.inf, math.nan])),
    ),
    "a text as state": lambda m, r, t: forged(r, state=7),
    "no seal": lambda m, r, t: forged(r, seal=None),
    "another key": lambda m, r, t: forged(r, seal=forged(r.seal, mac=_mac(r, b"another key"))),
    "another issuer": lambda m, r, t: forged(r, seal=forged(r.seal, issuer="somebody")),
    "half a seal": lambda m, r, t: forged(r, seal=forged(r.seal, mac=r.seal.mac[:32])),
    "a foreign seal": lambda m, r, t: forged(r, seal=forged(r.seal, mac="é" * 64)),
    "a value after sealing": lambda m, r, t: _command(m, r, value=_far(m, r)),
    "another name": lambda m, r, t: forged(r, id=r.id + "x"),
    "another diagnosis": lambda m, r, t: forged(r, diagnosis="d2"),
    "a replay": lambda m, r, t: m.draw.choice(m.old),
    "an old seal": lambda m, r, t: forged(r, seal=m.draw.choice(m.old).seal),
    "no request": lambda m, r, t: forged(r, actions=m.draw.choice([None, 3, "stop", ()])),
    "a heap of commands": lambda m, r, t: forged(
        r, actions=forged(r.actions, commands=tuple(Command(f"Z{k}", 1.0, None) for k in range(1000)))
    ),
}


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
