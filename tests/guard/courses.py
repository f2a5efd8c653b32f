"""Random courses: a guard on a vessel with which everything happens, second by second, and what becomes of it.

A course is drawn from its number alone: what the instruments say, how the link behaves, what people, recovery and
the plant's own control do, when the guard dies. What the guard does in each second is kept as a digest in
``courses.json``. A digest that differs is a decision that differs: `python -m tests.guard.courses --show 3 41` prints
second 41 of course 3, so that it can be compared with that of an earlier commit; `--write` keeps the digests anew.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from homeostat.domain.mode import Mode, Role, Side, Verb
from homeostat.domain.observation import Arm, Correction, FallBack, NoAction, Observation, Settled, Trouble, Withdraw
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy, Step
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from homeostat.journal.encode import encode_fields
from tests.guard.test_lapse import Sheds
from tests.guard.test_memory import Line
from tests.guard.vessel import ADJUSTED, BEGIN, CLOSE, DRAIN, MACHINE, POUR, ROUTE, RULES, Journal, World, awaited

KEPT = Path(__file__).with_name("courses.json")
COURSES, LONG = 100, 150
"""How many there are, and how long each is [s]."""
COOL = awaited("cool", "shut", "emptying", "L <= 5")
LATER = Step(COOL, (Command("F.sp", 0.0, 0.005), Command("V.man", 0.5, 0.2)))
SERVES = {"LIM-FULL": Effect(6.0), "LIM-HOT": Effect(8.0)}
TWO = replace(CLOSE, name="two", actions=replace(CLOSE.actions, then=(LATER,)), serves=SERVES)
HOLD = FallbackStrategy("hold", ActionSet((Command("F.sp", 0.0, 0.005),), "shut"), serves={"LIM-HOT": Effect(5.0)})
MACHINE_2 = replace(MACHINE, transitions=(*MACHINE.transitions, COOL))
GENTLE = ActionSet(
    ADJUSTED.commands, "running", (replace(POUR, commands=(Command("F.sp", 0.01, 0.005), Command("V.man", 0.5, 0.2))),)
)
ASKED = (ADJUSTED, ROUTE, GENTLE, ActionSet((Command("V.man", 0.4, 0.2),), "running"),
         ActionSet((Command("V.man", None, None), Command("T.sp", 300.0, 0.1)), "running"),
         ActionSet((Command("T.sp", 400.0, 0.5),), "running"), ActionSet((Command("F.sp", 0.0, 0.5),), "emptying"),
         ActionSet((), "running"))  # fmt: skip
READ: dict[str, tuple[float, ...]] = {
    "L": (8.0, 8.0, 9.5, 4.0, 0.5, 11.5, 12.3, 13.0, math.nan),
    "T": (305.0, 305.0, 310.0, 312.5, 314.0, 322.0, 500.0, math.nan),
    "Tx": (305.0, 305.0, 310.0, 320.0, math.nan),
}
FAULTS = ("hangs", "raises", "ignores", "errors", "silent", "deaf", "keeps", "void")


class Course:
    """One course, second by second."""

    def __init__(self, number: int) -> None:
        """Course ``number``, before its first second."""
        self._draw = random.Random(f"course {number}")
        self._settings = GuardSettings(sync_s=20.0, again_s=self._draw.choice((4.0, 10.0)))
        self._vessel, self._rules = Sheds(), self._ruled()
        self._trouble = self._draw.choice((1.0, 3.0, 6.0))
        mode = self._draw.choice((*[Mode.CLOSED_LOOP] * 3, Mode.APPROVE, Mode.OBSERVE, Mode.ADVISE))
        self._world = World(mode=mode, rules=self._rules, settings=self._settings, vessel=self._vessel)
        self._told = self._wired = self._count = 0
        self._before: list[str] = []
        self._state = ""
        self._news: set[str] = set()

    def seconds(self) -> Iterator[list[str]]:
        """What happened in each second, line by line."""
        for k in range(LONG):
            if k > 3:
                self._happens()
            yield self._second()

    def _ruled(self) -> GuardRules:
        one_in = self._draw.choice
        writables = dict(RULES.writables)
        if one_in((True, False)):
            writables = {t: replace(r, ramped_by=Side.GUARD) for t, r in writables.items()}
        fallbacks = one_in(((DRAIN, CLOSE), (TWO, replace(DRAIN, serves=SERVES)), (TWO, HOLD), (HOLD, TWO, DRAIN)))
        nominal, recipe = one_in(((BEGIN,), (BEGIN, POUR), ())), one_in((Side.GUARD, Side.GUARD, Side.PLANT))
        return replace(
            RULES, machine=MACHINE_2, writables=writables, fallbacks=fallbacks, nominal=nominal, recipe=recipe
        )

    def _happens(self) -> None:
        """A few things, each with a small chance."""
        draw, vessel = self._draw, self._vessel
        for tag, choices in READ.items():
            if draw.random() < 0.06:
                vessel.values[tag] = draw.choice(choices)
            elif draw.random() < 0.15:
                vessel.values[tag] = choices[0]
        for fault in FAULTS:
            now = bool(getattr(vessel, fault))
            if draw.random() < (0.35 if now else 0.006 * self._trouble):
                setattr(vessel, fault, not now)
        vessel.accepts_first = 1 if draw.random() < 0.04 else 100
        for chance, what in (
            (0.15 if self._news else 0.01, self._hand), (0.01, self._shed), (0.07, self._asks), (0.07, self._orders),
            (0.07, self._thinks), (0.01 * self._trouble, self._storm), (0.012, self._dies),
        ):  # fmt: skip
            if draw.random() < chance:
                what()
        if draw.random() < 0.2:
            self._tends()

    def _tends(self) -> None:
        """An engineer who wants the plant to run, and recovery when it does."""
        guard, order = self._world.guard, self._world.order
        out = sorted(guard.out_of_service)
        if guard.latched is not None:
            order(Verb.RESET, reason="it is over")
        elif not guard.mode.writes:
            order(Verb.MODE, self._draw.choice(("closed-loop", "closed-loop", "approve")), reason="on we go")
        elif guard.offered:
            order(Verb.APPROVE, guard.offered[0].id, digest=guard.offered[0].actions.digest, reason="good")
        elif out:
            order(Verb.IN_SERVICE, out[0], reason="mended")
        elif self._state in ("shut", "rest", "emptying"):
            order(Verb.START, "restart", reason="again")
        elif self._state == "running":
            self._asks()

    def _hand(self) -> None:
        """What was just written is what people care for."""
        tag = self._draw.choice(sorted(self._news or self._vessel.accepted))
        self._vessel.accepted[tag] = self._draw.choice(
            {"T.sp": (300.0, 311.0), "X.cmd": (0.0, 1.0)}.get(tag, (0.02, None))
        )

    def _shed(self) -> None:
        self._vessel.tells = self._draw.choice((True, False))
        self._vessel.shed()

    def _asks(self) -> None:
        self._count += 1
        state = self._state if self._draw.random() < 0.8 else "waiting"
        actions = self._draw.choice(ASKED)
        path = ("adjust", *(s.transition.name for s in actions.then))
        self._world.ask(name=f"r{self._count}", actions=actions, state=state, path=path)

    def _orders(self) -> None:
        draw, offered = self._draw, self._world.guard.offered
        role, person = draw.choice((*Role, *[Role.ENGINEER] * 4)), draw.choice(("Ada", "Bo"))
        verbs: tuple[Verb, ...] = (Verb.APPROVE, Verb.APPROVE, Verb.REJECT) if offered else (
            Verb.RESET, Verb.RESET, Verb.MODE, Verb.MODE, Verb.IN_SERVICE, Verb.OUT_OF_SERVICE, Verb.ACKNOWLEDGE,
            Verb.FALL_BACK, Verb.START, Verb.START,
        )  # fmt: skip
        verb = draw.choice(verbs)
        tags = sorted(self._rules.writables)
        subjects: dict[Verb, tuple[str, ...]] = {
            Verb.MODE: (*(m.value for m in Mode), Mode.CLOSED_LOOP.value), Verb.IN_SERVICE: (*tags, *tags, "Q"),
            Verb.OUT_OF_SERVICE: tuple(tags), Verb.START: ("restart", "restart", "start"),
            Verb.ACKNOWLEDGE: tuple(sorted(a.id for a in self._world.guard.alarms)) or ("none",),
        }  # fmt: skip
        if offered:
            self._world.order(verb, offered[0].id, role, person=person, digest=offered[0].actions.digest, reason="no")
        else:
            self._world.order(verb, draw.choice(subjects.get(verb, ("",))), role, person=person, reason="as drawn")

    def _thinks(self) -> None:
        draw, now_s = self._draw, self._vessel.now_s
        names = tuple(draw.sample([s.name for s in self._rules.fallbacks], 2))
        messages: tuple[Callable[[], Any], ...] = (
            lambda: Arm(names, now_s + draw.choice((3.0, 10.0, 30.0))), lambda: Arm(names, None), NoAction,
            lambda: FallBack("as drawn"), lambda: Trouble("recovery", "as drawn"), lambda: Settled("recovery"),
            lambda: Correction(({"T": 8.0}, {"T": 6.0})), lambda: Correction(({"T": -4.0},)), lambda: Correction(()),
            lambda: Withdraw(f"r{self._count}", "as drawn"),
        )  # fmt: skip
        self._world.guard.mailbox.put(draw.choice(messages)())

    def _storm(self) -> None:
        """The link fails in some way just when something is asked for, and a limit is violated soon after."""
        setattr(self._vessel, self._draw.choice(FAULTS), True)
        self._draw.choice((self._asks, self._asks, self._orders, self._thinks))()
        tag, value = self._draw.choice((("L", 13.0), ("L", 14.0), ("T", 322.0), ("L", math.nan), ("L", 4.0)))
        self._vessel.values[tag] = value

    def _dies(self) -> None:
        """The next guard has the journal up to some line, and perhaps needs a while to come."""
        events = self._world.journal.events
        kept = Journal(events[: len(events) - self._draw.choice((0, 0, 1, 2, 5))])
        memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in kept.events)
        self._vessel.now_s += self._draw.choice((0.0, 1.0, 20.0))
        self._told = len(kept.events)
        self._world = World(
            rules=self._rules, settings=self._settings, vessel=self._vessel, memory=memory, record=kept,
            goes_on=self._draw.random() < 0.7,
        )  # fmt: skip

    def _second(self) -> list[str]:
        seen = self._world.silent() if self._draw.random() < 0.03 else self._world.tick()
        events, wire = self._world.journal.events, self._vessel.wire
        lines = [_plain((at_s, e.kind, encode_fields(e, e.kind))) for e, at_s in events[self._told :]]
        lines += [_plain(("wire", at_s, [(c.tag, c.value, c.rate) for c in cs])) for at_s, cs in wire[self._wired :]]
        self._news = {c.tag for _, commands in wire[self._wired :] for c in commands}
        self._told, self._wired = len(events), len(wire)
        now = self._standing(seen)
        lines += [line for line in now if line not in self._before]
        self._before, self._state = now, seen.state
        return lines

    def _standing(self, seen: Observation) -> list[str]:
        """What lasts, of which only news is told."""
        guard = self._world.guard
        answers = [(a.request, a.status, a.finding and a.finding.criterion) for a in seen.answers]
        rest = [[s.transition.name for s in seen.rest.then], [(c.tag, c.value) for c in seen.rest.commands]]
        return [
            _plain(("mode", guard.mode, "state", seen.state, "latched", seen.latched, "by", seen.act_by_s)),
            _plain(("rest", rest, "way", seen.way and [t.name for t in seen.way.transitions], "refused", seen.refused)),
            _plain(("answers", answers, "entered", seen.entered)),
            _plain(("out of service", sorted(guard.out_of_service), "offered", [r.id for r in guard.offered])),
            _plain(("alarms", [(a.id, a.cause, a.acknowledged_by) for a in guard.alarms])),
            _plain(("carries", guard.carries, "leases", self._vessel.leases, self._vessel.given_back)),
            _plain(("heartbeat", len(self._vessel.beats) and self._vessel.beats[-1] == seen.now_s)),
        ]  # fmt: skip


def _plain(value: Any) -> str:
    """A line without the last digits of numbers."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {_plain(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "(" + ", ".join(map(_plain, value)) + ")"
    return str(value)


def digests(number: int) -> list[str]:
    """A short digest of every second of course ``number``."""
    return [
        hashlib.sha256("\n".join(lines).encode()).hexdigest()[:4] if lines else "" for lines in Course(number).seconds()
    ]


def main() -> None:
    """Show seconds of courses, or keep the digests of all of them."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--show", nargs="+", type=int, metavar="N", help="a course, and one of its seconds")
    parser.add_argument("--write", action="store_true")
    chosen = parser.parse_args()
    if chosen.show:
        number, *seconds = chosen.show
        for k, lines in enumerate(Course(number).seconds()):
            if k in (seconds or [k]):
                print(f"-- {k}", *lines, sep="\n")
    if chosen.write:
        kept = {str(n): " ".join(digests(n)) for n in range(COURSES)}
        KEPT.write_text(json.dumps(kept, indent=0) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
