"""The plant under attack, and what is done to it: plain Python, so that any version of the code can be attached to it.

A temperature on a straight line: dT/dt = ``heating`` (F.sp / 0.03 - 0.5) 2 [K/s]. Full feed heats at ``heating``, half
feed holds, no feed cools. Every reading of it wiggles by a few hundredths, as instruments do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

FULL, HALF = 0.03, 0.015
LIMIT_K = 313.0
"""Hard limit of the temperature [K]."""
WIGGLE = 0.02
"""Amplitude of what a reading moves about its value, in the tag's unit."""

Commands = list[tuple[str, float | None]]


@dataclass(frozen=True, slots=True)
class Bad:
    """Something that is wrong with the plant's link for a time."""

    kind: str
    """Of readings: silence, freeze, nan, missing, marked, offset, celsius, old, stuck-clock, clock.

    Of writes: half, hang, raise, ignore, pretend, late, slow (``by`` seconds from one command to the next).
    """
    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time before which it ends [s]."""
    tag: str = ""
    """Tag that is hit; empty for all."""
    by: float = 0.0
    """How far, or how many seconds later."""


@dataclass(frozen=True, slots=True)
class Hand:
    """Somebody at the plant moves a tag."""

    at_s: float
    tag: str
    value: float | None


@dataclass(frozen=True, slots=True)
class Ask:
    """Somebody wants commands written; ``forged`` says what is wrong with the approval."""

    at_s: float
    commands: tuple[tuple[str, float | None, float | None], ...] = (("F.sp", HALF, 0.005),)
    forged: str = ""
    """Empty, or: self-made, old, future, nan, altered, altered-later, replayed, delayed, configuration."""


@dataclass(frozen=True, slots=True)
class Attack:
    """What is done to the plant and to whoever watches it."""

    start: float = 305.0
    """Temperature at the start [K]."""
    heating: float = 0.1
    """dT/dt at full feed [K/s]."""
    level: float = 8.0
    """Level at the start [L]."""
    filling: float = 0.0
    """dL/dt [L/s]."""
    jump_s: float = math.inf
    """Process time at which the true temperature steps [s]."""
    jump_K: float = 0.0
    """By how much."""
    end_s: float = 120.0
    """Process time at which the run ends [s]."""
    notices_s: tuple[float, ...] = ()
    """When monitoring notices something [s]."""
    thinking_s: float = 1.0
    """Process time that one stretch of thinking costs [s]."""
    hangs: str = ""
    """Part of recovery that never answers: diagnosis, planning, action, release-check."""
    error: float = 0.0
    """How much too high a diagnosis says that the temperature reads [K]."""
    bad: tuple[Bad, ...] = ()
    """What is wrong with the link."""
    hands: tuple[Hand, ...] = ()
    """What people at the plant do."""
    asks: tuple[Ask, ...] = ()
    """What is asked of whoever writes."""
    trip_s: float = math.inf
    """Process time at which a fallback is ordered [s]."""
    dies_s: float = math.inf
    """Process time at which the process is killed and started again [s]."""
    stops_s: float = math.inf
    """Process time at which a person stops the run [s]."""
    journal: str = ""
    """What is wrong with the journal: full, subscriber, hang."""
    journal_s: float = 0.0
    """From when [s]."""
    step_s: float = 1.0
    """Sampling period [s]."""


@dataclass(slots=True)
class Report:
    """What an attack came to."""

    wire: list[Any] = field(default_factory=list)
    """[process time, [[tag, value], ...], whether the journal held it by then] for everything that was sent."""
    arrived: list[Any] = field(default_factory=list)
    """[process time, tag, value] for everything that took effect, people's moves left out."""
    readings: list[Any] = field(default_factory=list)
    """[process time, temperature as it was read]."""
    truth: list[float] = field(default_factory=list)
    """True temperature, one per second."""
    accepted: dict[str, float | None] = field(default_factory=dict)
    """Targets at the end."""
    latched: str | None = None
    """Why a fallback acted; None while none has."""
    alarms: list[str] = field(default_factory=list)
    """Alarms that were raised."""
    journal: list[Any] = field(default_factory=list)
    """[kind, process time] of every event."""
    refused: list[str] = field(default_factory=list)
    """Why asks were refused, one each."""
    fallbacks: list[float] = field(default_factory=list)
    """When a fallback was sent [s]."""
    ended: str = ""
    """Why supervision ended early; empty where it did not."""

    @property
    def peak(self) -> float:
        """Highest true temperature [K]."""
        return max(self.truth)

    @property
    def above_s(self) -> int:
        """Seconds for which the true temperature was above its limit."""
        return sum(t > LIMIT_K for t in self.truth)

    @property
    def crossed_s(self) -> float:
        """Process time at which the true temperature first passes its limit [s]."""
        return next((float(k + 1) for k, t in enumerate(self.truth) if t > LIMIT_K), math.inf)


def violated_s(report: Report, cusum: float = 0.5) -> float:
    """When the readings violate the limit after its filter: the cumulative sum of the violation passes ``cusum`` [s].

    Computed from what was read alone; a reading that is none adds nothing.
    """
    total, before_s = 0.0, 0.0
    for at_s, hot in report.readings:
        if hot is None or not math.isfinite(hot):
            continue
        total, before_s = max(0.0, total + (hot - LIMIT_K) * (at_s - before_s)), at_s
        if total > cusum and hot > LIMIT_K:
            return float(at_s)
    return math.inf


class Broken(ConnectionError):
    """The link broke during a write."""


class AttackedPlant:
    """The plant: one second at a time, and it remembers everything that came over its wire."""

    def __init__(self, attack: Attack) -> None:
        self.attack = attack
        self.now_s = 0.0
        self.hot, self.level = attack.start, attack.level
        self.accepted: dict[str, float | None] = {"F.sp": FULL, "V.man": None}
        self.report = Report()
        self.busy_until_s = 0.0
        self._late: list[tuple[float, str, float | None]] = []
        self._pretended: dict[str, float | None] = {}
        self._pause_s = max((b.by for b in attack.bad if b.kind == "slow"), default=0.0)
        self._held: dict[Bad, tuple[float, dict[str, float]]] = {}

    @property
    def ended(self) -> bool:
        return self.now_s >= self.attack.end_s

    def second(self) -> None:
        """Let one second pass."""
        self.now_s += 1.0
        for hand in self.attack.hands:
            if hand.at_s == self.now_s:
                self.accepted[hand.tag] = hand.value
        due = [late for late in self._late if late[0] <= self.now_s]
        self._late = [late for late in self._late if late[0] > self.now_s]
        for _, tag, value in due:
            self._arrive(tag, value)
        feed = self.accepted["F.sp"] or 0.0
        self.hot += self.attack.heating * 2.0 * (feed / FULL - 0.5)
        self.hot += self.attack.jump_K if self.now_s == self.attack.jump_s else 0.0
        self.level += self.attack.filling
        self.report.truth.append(self.hot)

    def sample(self) -> dict[str, Any] | None:
        """The sample of this second as it comes through; None where none does."""
        feed, wiggle = self.accepted["F.sp"] or 0.0, WIGGLE * math.sin(7.0 * self.now_s)
        values = {
            "T": self.hot + wiggle, "L": self.level + wiggle / 10.0, "F": feed + wiggle / 1000.0, "T.sp": 300.0,
            "F.sp": feed, "L.sp": 8.0, "V.man": math.nan if self.accepted["V.man"] is None else self.accepted["V.man"],
        }  # fmt: skip
        seen: dict[str, Any] = {"at_s": self.now_s, "values": values, "bad": [], "taken_s": {}}
        for bad in self.attack.bad:
            if bad.from_s <= self.now_s < bad.to_s:
                held_s, held = self._held.setdefault(bad, (self.now_s, dict(values)))
                if not _distort(bad, seen, held_s, held):
                    return None
        self.report.readings.append([self.now_s, seen["values"].get("T")])
        return seen

    @property
    def read_back(self) -> dict[str, float | None]:
        """Targets that the plant says it has accepted."""
        return {**self.accepted, **self._pretended}

    def send(self, commands: Commands, journalled: bool, fallback: bool) -> bool:
        """Commands arrive on the wire; whether the answer comes at once. Raises Broken."""
        self.report.wire.append([self.now_s, [list(c) for c in commands], journalled])
        if fallback:
            self.report.fallbacks.append(self.now_s)
        writes = ("half", "hang", "raise", "ignore", "pretend", "late", "slow")
        bad = next((b for b in self.attack.bad if b.kind in writes and b.from_s <= self.now_s < b.to_s), None)
        kind = "" if bad is None else bad.kind
        if kind in ("half", "raise"):
            commands = commands[:1]
        if kind in ("ignore", "pretend", "hang"):
            self._pretended.update(dict(commands) if kind == "pretend" else {})
            commands = []
        for number, (tag, value) in enumerate(commands):
            delay_s = {"late": 0.0 if bad is None else bad.by, "slow": number * self._pause_s}.get(kind, 0.0)
            if delay_s > 0.0:
                self._late.append((self.now_s + delay_s, tag, value))
            else:
                self._arrive(tag, value)
        if kind == "slow":
            self.busy_until_s = self.now_s + (len(commands) - 1) * self._pause_s
        if kind == "raise":
            raise Broken("the link broke during the write")
        return kind not in ("hang", "slow")

    def _arrive(self, tag: str, value: float | None) -> None:
        self.accepted[tag] = value
        self._pretended.pop(tag, None)
        self.report.arrived.append([self.now_s, tag, value])


def _distort(bad: Bad, seen: dict[str, Any], held_s: float, held: dict[str, float]) -> bool:
    """Change what is seen; False where nothing is."""
    values = seen["values"]
    tags: Sequence[str] = [bad.tag] if bad.tag else list(values)
    match bad.kind:
        case "silence":
            return False
        case "freeze":
            values.update({t: held[t] for t in tags})
        case "old":
            values.update({t: held[t] for t in tags})
            seen["taken_s"].update(dict.fromkeys(tags, held_s))
        case "nan":
            values.update(dict.fromkeys(tags, math.nan))
        case "missing":
            for tag in tags:
                values.pop(tag, None)
        case "marked":
            seen["bad"] += tags
        case "offset":
            values.update({t: values[t] + bad.by for t in tags})
        case "celsius":
            values.update({t: values[t] - 273.15 for t in tags})
        case "stuck-clock":
            seen["at_s"] = held_s
        case "clock":
            seen["at_s"] += bad.by
    return True


def as_data(attack: Attack) -> dict[str, Any]:
    """``attack`` as plain data."""
    return asdict(attack)


def from_data(data: dict[str, Any]) -> Attack:
    """The attack that :func:`as_data` gave."""
    parts: dict[str, Any] = {"bad": Bad, "hands": Hand, "asks": Ask}
    made = {name: tuple(kind(**d) for d in data[name]) for name, kind in parts.items()}
    return Attack(**{**data, **made, "notices_s": tuple(data["notices_s"])})
