"""What happens on a bad day, every twenty minutes by a seeded script, and what the guard must do about each."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.guard.scripted_plants import SHAPES
from homeostat.domain.events.guard import QualityChanged
from homeostat.domain.events.people import AlarmRaised, ServiceChanged
from homeostat.domain.events.trips import FallbackSkipped, FallbackStands, Shed, Tripped
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.plant.rules import SIGMAS, GuardRules
from homeostat.domain.ports import GuardEvent
from tests.equipment.links.misbehaving.link import ByHand, Misbehaviour
from tests.equipment.links.misbehaving.readings import ALL, Freeze, Lie, NotANumber, Silence
from tests.equipment.links.misbehaving.writes import Disobedient
from tests.equipment.links.scripted import Push

EVERY_S = 1200.0
"""Time between two of them [s]."""
LASTS_S = 60.0
"""How long a reading is wrong [s]."""
ATTEMPT_S = 4.0
"""Longest time between two attempts at one write [s]."""
KINDS = ("violates", "lies", "freezes", "disobeys", "changed by hand", "goes silent", "is no number")

Match = Callable[[GuardEvent], bool]


@dataclass(frozen=True)
class Expected:
    """One reaction, and the last time at which it is in time."""

    text: str
    match: Match
    from_s: float
    by_s: float


@dataclass(frozen=True)
class Incident:
    """One thing that happens."""

    kind: str
    about: str
    at_s: float
    expected: tuple[Expected, ...]
    script: tuple[Misbehaviour, ...] = ()
    pushes: tuple[Push, ...] = ()

    @property
    def trips(self) -> bool:
        """Whether a fallback is expected of it."""
        return any(e.text == "trip" for e in self.expected)


class DayScript:
    """Draws incidents for one plant."""

    def __init__(self, rules: GuardRules, rest: dict[str, float], seed: int) -> None:
        """``rest``: tag -> what it reads when nothing is wrong."""
        self._rules, self._rest, self._draw = rules, rest, random.Random(seed)
        self._deck: list[str] = []
        self._by_hand: dict[str, float] = {}
        self._make = dict(
            zip(
                KINDS,
                (self._violates, self._lies, self._freezes, self._disobeys, self._hand, self._silent, self._nan),
                strict=True,
            )
        )

    def incidents(self, length_s: float) -> tuple[Incident, ...]:
        """One every twenty minutes until ``length_s``; each kind once before any comes again."""
        times = [600.0 + EVERY_S * k for k in range(int((length_s - 600.0) // EVERY_S))]
        return tuple(self._next(at_s + self._draw.randrange(60)) for at_s in times)

    def _next(self, at_s: float) -> Incident:
        if not self._deck:
            self._deck = list(KINDS)
            self._draw.shuffle(self._deck)
        return self._make[self._deck.pop()](at_s)

    def _violates(self, at_s: float) -> Incident:
        limit, pushes = self._violation(at_s, 2 * LASTS_S)
        expected = (*_trip(at_s, at_s + 20.0, limit), _stands(at_s, at_s + 35.0))
        return Incident("violates", limit, at_s, expected, pushes=pushes)

    def _disobeys(self, at_s: float) -> Incident:
        limit, pushes = self._violation(at_s, 4 * LASTS_S)
        obeys_s = at_s + 2 * LASTS_S
        vain_s = at_s + 20.0 + 3 * ATTEMPT_S * len(self._rules.fallbacks)
        skipped = tuple(
            Expected(f"{s.name} given up", _skipped(s.name), at_s, vain_s)
            for s in self._rules.fallbacks
            if limit in s.serves
        )  # fmt: skip
        expected = (
            *_trip(at_s, at_s + 20.0, limit), *skipped,
            Expected("shed", lambda e: isinstance(e, Shed), at_s, vain_s + 1.0),
            _stands(obeys_s, obeys_s + 30.0),
        )  # fmt: skip
        return Incident("disobeys", limit, at_s, expected, (Disobedient(ALL, at_s - 1.0, obeys_s),), pushes)

    def _lies(self, at_s: float) -> Incident:
        found = []
        for tag, rule in self._rules.qualities.items():
            if rule.fastest is not None:
                by = 1.5 * (rule.fastest + SIGMAS * (rule.noise or 0.0))
                within = self._rules.tags[tag].range
                found += [(tag, s * by) for s in (1, -1) if within.contains(self._rest[tag] + s * by)]
        tag, by = self._draw.choice(found)
        expected = [Expected("uncertain at once", _quality(tag, "uncertain"), at_s, at_s)]
        for limit, margin in self._affected({tag: self._rest[tag] + by}).items():
            sum_s = 2.0 * self._rules.trips[limit].cusum / -margin  # twice the time without noise
            by_s = at_s + self._rules.qualities[tag].grace_s + math.ceil(sum_s) + 2.0
            expected += [*_trip(at_s, by_s, limit), _stands(at_s, by_s + 15.0)]
        script = (Lie(tag, by, at_s, at_s + LASTS_S),)
        return Incident("lies", f"{tag} by {by:.3g}", at_s, tuple(expected), script)

    def _freezes(self, at_s: float) -> Incident:
        rules = self._rules.qualities
        tag = self._draw.choice([t for t, rule in rules.items() if rule.noise and rule.frozen_s is not None])
        frozen_s = rules[tag].frozen_s or 0.0
        expected = [Expected("bad as frozen", _quality(tag, "bad"), at_s, at_s + frozen_s + 1.0)]
        expected += self._blind(tag, at_s, at_s + frozen_s)
        return Incident("freezes", tag, at_s, tuple(expected), (Freeze(frozenset({tag}), at_s, at_s + LASTS_S),))

    def _nan(self, at_s: float) -> Incident:
        tag = self._draw.choice([t for t in self._rules.qualities if t not in self._rules.writables])
        expected = [Expected("bad at once", _quality(tag, "bad"), at_s, at_s), *self._blind(tag, at_s, at_s)]
        script = (NotANumber(frozenset({tag}), at_s, at_s + LASTS_S),)
        return Incident("is no number", tag, at_s, tuple(expected), script)

    def _silent(self, at_s: float) -> Incident:
        stale_s = max(rule.stale_s for rule in self._rules.qualities.values())
        grace_s = max(self._rules.trips[limit.name].grace_s for limit in self._rules.limits.hard)
        end_s = at_s + LASTS_S
        expected = (
            Expected("alarm of the link", _alarm("link"), at_s, at_s),
            *_trip(at_s, at_s + stale_s + grace_s + 2.0), _stands(end_s, end_s + 20.0),
        )  # fmt: skip
        return Incident("goes silent", "no sample", at_s, expected, (Silence(at_s, end_s),))

    def _hand(self, at_s: float) -> Incident:
        tag = self._draw.choice(list(self._rules.writables))
        within, tolerance = self._rules.tags[tag].range, self._rules.writables[tag].tolerance
        value = within.low + self._draw.uniform(0.3, 0.6) * within.span
        while abs(value - self._by_hand.get(tag, math.inf)) < 3.0 * tolerance:
            value = within.low + self._draw.uniform(0.3, 0.6) * within.span
        self._by_hand[tag] = value
        expected = (
            Expected("out of service", _out_of_service(tag), at_s, at_s + 1.0),
            Expected("alarm of it", _alarm(f"moved:{tag}"), at_s, at_s + 1.0),
        )
        return Incident("changed by hand", tag, at_s, expected, (ByHand(tag, value, at_s),))

    def _violation(self, at_s: float, lasts_s: float) -> tuple[str, tuple[Push, ...]]:
        limit, pushes = self._draw.choice(list(SHAPES[self._rules.plant].violations.items()))
        return limit, tuple(Push(tag, by, at_s, at_s + lasts_s) for tag, by in pushes)

    def _blind(self, tag: str, at_s: float, from_s: float) -> list[Expected]:
        """What follows where no value of ``tag`` leaves a hard limit undecided."""
        expected: list[Expected] = []
        for limit in self._affected({tag: math.nan}):
            grace_s = self._rules.trips[limit].grace_s
            expected += _trip(at_s, from_s + grace_s + 2.0, limit)
            expected.append(_stands(at_s, from_s + grace_s + 20.0))
        return expected

    def _affected(self, wrong: dict[str, float]) -> dict[str, float]:
        """Hard limits that are violated or undecided where everything else is as it rests, with their margins."""
        values = {**self._rest, **wrong}
        margins = {limit.name: limit.formula.margin_at(values) for limit in self._rules.limits.hard}
        return {name: margin for name, margin in margins.items() if not margin >= 0.0}


def _trip(from_s: float, by_s: float, limit: str | None = None) -> tuple[Expected, ...]:
    return (
        Expected("trip", lambda e: isinstance(e, Tripped) and limit in (None, e.limit), from_s, by_s),
        Expected(
            "fallback sent", lambda e: isinstance(e, WriteIntended) and e.cause is Cause.FALLBACK, from_s, by_s
        ),
    )  # fmt: skip


def _stands(from_s: float, by_s: float) -> Expected:
    return Expected("fallback stands", lambda e: isinstance(e, FallbackStands), from_s, by_s)


def _skipped(name: str) -> Match:
    return lambda e: isinstance(e, FallbackSkipped) and e.strategy == name


def _quality(tag: str, quality: str) -> Match:
    return lambda e: isinstance(e, QualityChanged) and (e.tag, e.quality) == (tag, quality)


def _alarm(name: str) -> Match:
    return lambda e: isinstance(e, AlarmRaised) and e.alarm == name


def _out_of_service(tag: str) -> Match:
    return lambda e: isinstance(e, ServiceChanged) and e.tag == tag and not e.in_service
