"""Facts of a stretch of a journal: modes, alarms, quality of readings, diagnoses, and what was asked for."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from homeostat.domain.diagnosis import by_fault_set
from homeostat.domain.events.guard import GuardStarted, QualityChanged, RequestAnswered, Stopped, ThinkingEnded
from homeostat.domain.events.people import AlarmRaised, AlarmReturned, ModeEntered
from homeostat.domain.events.recovery import Attempted, Diagnosed
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.recovery import Command
from homeostat.journal import Record
from homeostat.record.decode import decode

SAID = ("advised", "offered", "confirmed", "refused", "failed", "withdrawn")
"""How far a request has come, as far as a person wants to know."""


@dataclass(slots=True)
class Lasting:
    """Something that begins and ends again."""

    times: int = 0
    """How often it began."""
    lasted_s: float = 0.0
    """How long it lasted in all [s of process time]."""
    longest_s: float = 0.0
    """How long it lasted at most [s of process time]."""
    text: str = ""
    """What was said of it last."""
    _since_s: float = math.nan

    @property
    def lasts(self) -> bool:
        """Whether it has begun and not ended."""
        return not math.isnan(self._since_s)

    def begin(self, at_s: float, text: str = "") -> None:
        """It begins at process time ``at_s`` [s]; what lasts already goes on."""
        self.text = text or self.text
        if not self.lasts:
            self.times, self._since_s = self.times + 1, at_s

    def end(self, at_s: float) -> None:
        """It ends at process time ``at_s`` [s]."""
        if self.lasts:
            for_s = max(at_s - self._since_s, 0.0)
            self.lasted_s, self.longest_s = self.lasted_s + for_s, max(self.longest_s, for_s)
            self._since_s = math.nan


@dataclass(frozen=True, slots=True)
class Asked:
    """A request, and how far it came."""

    at_s: float
    """Process time of the last word on it [s]."""
    proposer: str
    """Who proposed it."""
    status: str
    """How far it came."""
    reason: str
    """Why no further; empty where nothing was against it."""
    commands: tuple[Command, ...]
    """What it would write at once; nothing where the journal does not say."""


@dataclass(slots=True)
class Facts:
    """What a stretch of a journal says."""

    plant: str = ""
    """Name of the plant."""
    from_s: float = 0.0
    """Process time at which the stretch begins [s]."""
    to_s: float = 0.0
    """Process time of the last line [s]."""
    modes: dict[str, Lasting] = field(default_factory=dict)
    """Mode -> how long the guard stood in it."""
    unguarded: Lasting = field(default_factory=Lasting)
    """How often and how long there was no guard: from its stop, or from its last line where it was killed."""
    alarms: dict[str, Lasting] = field(default_factory=dict)
    """Alarm -> how often and how long."""
    bad: dict[str, Lasting] = field(default_factory=dict)
    """Tag -> how often and how long its reading was bad."""
    uncertain: dict[str, Lasting] = field(default_factory=dict)
    """Tag -> how often and how long its reading was uncertain."""
    diagnosed: list[tuple[float, str, float]] = field(default_factory=list)
    """Process time, what was likeliest, and its probability, wherever that changed."""
    asked: dict[str, Asked] = field(default_factory=dict)
    """Request -> how far it came."""
    counts: Counter[str] = field(default_factory=Counter)
    """What else happened -> how often."""
    lacking: str = ""
    """What the journal lacks at its end, in one sentence; empty where nothing is known to be missing."""

    @property
    def lasting(self) -> tuple[dict[str, Lasting], ...]:
        """Everything that ends with a guard: the one that begins again knows nothing of it, and says it anew."""
        return self.modes, self.alarms, self.bad, self.uncertain

    @property
    def length_s(self) -> float:
        """Length of the stretch [s of process time]."""
        return max(self.to_s - self.from_s, 0.0)

    def share(self, lasting: Lasting) -> float:
        """The part of the stretch for which something lasted [1]."""
        return lasting.lasted_s / self.length_s if self.length_s > 0.0 else 0.0


_TOLD: Final = frozenset(
    event.kind
    for event in (
        *(GuardStarted, ModeEntered, AlarmRaised, AlarmReturned, QualityChanged),
        *(Attempted, Diagnosed, RequestAnswered),
    )
)
"""Kinds of the events whose fields count; of the others it counts that they happened, and when."""


def condensed(record: Record) -> Record:
    """``record`` without fields that no fact follows from: months of a journal must fit into memory."""
    return record if record.kind in _TOLD else replace(record, fields={})


_COUNTED: Mapping[str, str] = {
    GuardStarted.kind: "starts of the guard",
    ThinkingEnded.kind: "deaths of thinking",
    FallbackActivated.kind: "fallbacks",
}


def facts_of(records: Iterable[Record], last_s: float = math.inf, until_s: float = math.inf) -> Facts:
    """What ``records``, a whole journal in order, say of the ``last_s`` up to ``until_s`` [s of process time].

    What began before the stretch counts from its begin; where the journal ends earlier, the stretch does.
    """
    every = tuple(records)
    known = tuple(record for record in every if record.at_s <= until_s)
    facts = Facts(to_s=min(every[-1].at_s, until_s) if known else 0.0)
    facts.from_s = max(facts.to_s - last_s, known[0].at_s if known else 0.0)
    tried: dict[str, tuple[Command, ...]] = {}
    before_s = math.nan
    for record in known:
        inside = record.at_s >= facts.from_s
        if inside and record.kind in _COUNTED:
            facts.counts[_COUNTED[record.kind]] += 1
        if record.kind == Stopped.kind:
            _leave(facts, record.at_s)
        elif record.kind == GuardStarted.kind:
            _return(facts, before_s, record.at_s)
        if record.kind in _TOLD:
            _take(facts, record, tried, inside)
        before_s = record.at_s
    for lasting in (facts.unguarded, *(x for group in facts.lasting for x in group.values())):
        lasting.end(facts.to_s)
    return facts


def _leave(facts: Facts, at_s: float) -> None:
    """The guard has ended at process time ``at_s`` [s]."""
    for group in facts.lasting:
        for name in tuple(group):
            _end(group, name, at_s, at_s >= facts.from_s)
    facts.unguarded.begin(max(at_s, facts.from_s))


def _return(facts: Facts, before_s: float, at_s: float) -> None:
    """A guard begins at process time ``at_s`` [s]; the last line before that is of ``before_s`` [s]."""
    if facts.plant and not facts.unguarded.lasts:  # the one before was killed, and nobody said when
        _leave(facts, before_s)
    if at_s >= facts.from_s:
        facts.unguarded.end(at_s)
    else:
        facts.unguarded = Lasting()


def _take(facts: Facts, record: Record, tried: dict[str, tuple[Command, ...]], inside: bool) -> None:
    at_s = max(record.happened_s, facts.from_s)
    match decode(record):
        case GuardStarted(plant=plant):
            facts.plant = plant
        case ModeEntered(mode=mode):
            for name in tuple(facts.modes):
                _end(facts.modes, name, at_s, inside)
            facts.modes.setdefault(mode, Lasting()).begin(at_s)
        case AlarmRaised(alarm=alarm, cause=cause):
            facts.alarms.setdefault(alarm, Lasting()).begin(at_s, cause)
        case AlarmReturned(alarm=alarm) if alarm in facts.alarms:
            _end(facts.alarms, alarm, at_s, inside)
        case QualityChanged(tag=tag, quality=quality, reason=reason):
            for name, group in (("bad", facts.bad), ("uncertain", facts.uncertain)):
                if quality == name:
                    group.setdefault(tag, Lasting()).begin(at_s, reason)
                elif tag in group:
                    _end(group, tag, at_s, inside)
        case Attempted(digest=digest, commands=commands):
            tried[digest] = commands
        case Diagnosed(hypotheses=hypotheses) if inside and (best := next(iter(by_fault_set(hypotheses)), None)):
            if not facts.diagnosed or facts.diagnosed[-1][1] != best.name:
                facts.diagnosed.append((record.happened_s, best.name, best.probability))
        case RequestAnswered() as said if inside and said.status in SAID:
            commands = tried.get(said.digest, ())
            facts.asked[said.request] = Asked(record.happened_s, said.proposer, said.status, said.reason, commands)


def _end(group: dict[str, Lasting], name: str, at_s: float, inside: bool) -> None:
    """``name`` has ended; where that was before the stretch, it is none of its facts."""
    if inside:
        group[name].end(at_s)
    else:
        del group[name]
