"""Makes requests, good ones and good ones that something was done to."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from typing import Any

from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.request import Request, Seal
from tests.guard.oracle import mac_of, sealed


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
    "another key": lambda m, r, t: forged(r, seal=forged(r.seal, mac=mac_of(r, b"another key"))),
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
