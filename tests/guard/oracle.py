"""Seals made by hand, and an oracle that knows the tables but not the guard."""

from __future__ import annotations

import hashlib
import hmac
import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.request import Request, Seal

KEY = b"a key that proposers do not have"
OLDEST_S = 30.0


def sealed(request: Request, checked_s: float, lasts_s: float = 30.0, nonce: str | None = None) -> Request:
    """``request`` with a seal made by hand, so that the tests need no code of the guard for it."""
    name = nonce or f"nonce-{request.id}-{checked_s}"
    blank = replace(request, seal=Seal("check", checked_s, checked_s + lasts_s, name, ""))
    return replace(blank, seal=replace(blank.seal, mac=mac_of(blank, KEY)))


def mac_of(request: Request, key: bytes) -> str:
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
        if r.seal.issuer != "check" or r.seal.mac != mac_of(r, KEY):
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
