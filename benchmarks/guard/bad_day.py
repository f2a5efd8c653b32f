"""A day on a scripted plant on which something is wrong every twenty minutes, with a person who resets."""

from __future__ import annotations

import tempfile
import time
from bisect import bisect_left
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.guard.day_script import EVERY_S, KINDS, DayScript, Incident
from benchmarks.guard.scripted_plants import SHAPES, script_of, written_at_start
from benchmarks.guard.store import FAST, Sizes
from benchmarks.guard.timed import Memory, Timed
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import Observation
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.ports import GuardEvent
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Journal
from homeostat.links.errors import LinkError
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import guard_rules
from tests.equipment.links.misbehaving.link import Misbehaving
from tests.equipment.links.scripted import ScriptedPlant

SEED = 7
HOME_S = 590.0
"""By then the plant stands where it stands when nothing is wrong [s]."""
COMES_S = 300.0
"""How long after an incident the person comes [s]."""
SETTINGS = GuardSettings(sync_s=10.0)
"""Whatever else the host does, what a simulated second does must not depend on it."""
BACK_S = 900.0
"""How long after it everything must be as it was [s]."""


class Person:
    """Brings the plant back, one order every five seconds: reset, mode, tags in service, start."""

    def __init__(self, guard: Guard, rules: GuardRules, link: Misbehaving) -> None:
        self._guard, self._rules, self._link, self.orders = guard, rules, link, 0
        self.home: str | None = None

    def back(self, seen: Observation) -> bool:
        """Whether everything is as it was."""
        guard = self._guard
        free = guard.latched is None and not guard.out_of_service
        return free and guard.mode is Mode.CLOSED_LOOP and seen.state == self.home

    def look(self, seen: Observation) -> None:
        """Give the order that is due."""
        guard = self._guard
        if seen.now_s % 5.0 or self.back(seen):
            return
        if guard.latched is not None:
            self._order(Verb.RESET)
        elif guard.mode is not Mode.CLOSED_LOOP:
            self._order(Verb.MODE, Mode.CLOSED_LOOP.value)
        elif guard.out_of_service:
            self._order(Verb.IN_SERVICE, min(guard.out_of_service))
        else:
            leading = [t for t in self._rules.machine.transitions if t.source == seen.state and t.event == "restart"]
            if leading and not self._drained(seen):
                self._order(Verb.START, leading[0].name)

    def _drained(self, seen: Observation) -> bool:
        """Whether something had to be moved by hand before a restart, and was."""
        held = {} if seen.sample is None else seen.sample.accepted
        wanted = SHAPES[self._rules.plant].drained
        wrong = [(t, v) for t, v in wanted.items() if (held.get(t) or 0.0) > v + 1e-6]
        for tag, value in wrong:
            self._link.operate(tag, value)
        return bool(wrong)

    def _order(self, verb: Verb, subject: str = "") -> None:
        self.orders += 1
        order = PersonCommand(f"o{self.orders}", "Ada", Role.ENGINEER, verb, subject, reason="seen and put right")
        self._guard.mailbox.put(order)


def measure(plant: str, sizes: Sizes) -> dict[str, Any]:
    """The day of ``plant``."""
    case = load_plant(plant)
    rules, began = guard_rules(case), time.monotonic()
    plain = script_of(case, rules, sizes.days_s, SEED)
    rest = {t.tag: t.start for t in plain.tags}
    rest |= {tag: v for tag, v in written_at_start(case, rules).items() if v is not None}
    incidents = DayScript(rules, rest, SEED).incidents(sizes.days_s)
    script = script_of(case, rules, sizes.days_s, SEED, tuple(p for i in incidents for p in i.pushes))
    link = Misbehaving(SimulatedLink(ScriptedPlant(script)), tuple(m for i in incidents for m in i.script))
    events: list[tuple[float, GuardEvent]] = []
    with tempfile.TemporaryDirectory(dir=FAST) as folder, Journal(Path(folder) / "run") as journal:
        journal.subscribe(lambda event, at_s: events.append((at_s, event)))
        guard = Guard(rules, Attachment(journal, lease=link), SETTINGS)
        timed, memory, day = Timed(guard), Memory(), Day(guard, rules, link, incidents)
        for seen in day.run(timed):
            memory(seen)
        guard.stop("the day is over")
    missed, unexpected = judge(incidents, events, rules)
    return {
        "plant": plant, "length_s": sizes.days_s, "wall_s": time.monotonic() - began, "ticks": len(timed.wall_s),
        "incidents": {kind: sum(i.kind == kind for i in incidents) for kind in KINDS},
        "expected": sum(len(i.expected) for i in incidents), "missed": missed, "unexpected": unexpected,
        "not_back": day.not_back, "orders": day.person.orders, "decision": timed.summary(),
        "memory": memory.samples, "growth": memory.growth(), "raised": day.raised,
        "fallbacks": sum(isinstance(e, FallbackActivated) for _, e in events),
        "attempts": sum(isinstance(e, WriteIntended) for _, e in events),
    }  # fmt: skip


class Day:
    """The day itself: link, guard and person, second by second."""

    def __init__(self, guard: Guard, rules: GuardRules, link: Misbehaving, incidents: tuple[Incident, ...]) -> None:
        self.person, self._link, self._times = Person(guard, rules, link), link, [i.at_s for i in incidents]
        self.not_back: list[float] = []
        self.raised: list[str] = []

    def run(self, guard: Timed) -> Iterator[Observation]:
        """Every observation."""
        link, since_s = self._link, float("inf")
        while not link.ended:
            sample = _sample(link)
            try:
                seen = guard.tick(link.now_s, sample)
            except Exception as error:  # the guard must never raise; where it does, that is a figure of the page
                self.raised.append(f"{link.now_s:.0f} s: {error!r}")
                continue
            if link.now_s == HOME_S:
                self.person.home = seen.state
            at = bisect_left(self._times, link.now_s) - 1
            since_s = link.now_s - self._times[at] if at >= 0 else float("inf")
            if COMES_S <= since_s < BACK_S:
                self.person.look(seen)
            if since_s == BACK_S and not self.person.back(seen):
                self.not_back.append(self._times[at])
            yield seen


def judge(
    incidents: tuple[Incident, ...], events: list[tuple[float, GuardEvent]], rules: GuardRules
) -> tuple[list[str], list[str]]:
    """Reactions that did not come in time, and fallbacks that nothing had asked for."""
    missed, unexpected = [], []
    for i in incidents:
        about = f"{i.at_s:.0f} s, {i.kind} ({i.about})"
        during = [(at_s, e) for at_s, e in events if i.at_s - 60.0 <= at_s < i.at_s + EVERY_S - 60.0]
        for x in i.expected:
            if not any(x.from_s <= at_s <= x.by_s and x.match(e) for at_s, e in during):
                later = next((f"{at_s:.0f} s" for at_s, e in during if at_s >= x.from_s and x.match(e)), "never")
                missed.append(f"{about}: {x.text} by {x.by_s:.0f} s, came {later}")
        if not i.trips:
            unexpected += [f"{about}: {e.reason}" for _, e in during if isinstance(e, FallbackActivated)]
    return missed, unexpected


def _sample(link: Misbehaving) -> Snapshot | None:
    try:
        return link.advance()
    except LinkError:
        return None
