"""The alarms of a run in the states of ISA-18.2, a fold of its events; how many come at a time."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import GuardStarted
from homeostat.domain.events.people import AlarmAcknowledged, AlarmRaised, AlarmReturned, AlarmShelved, AlarmUnshelved
from homeostat.journal.memory import Entry
from homeostat.record.story.plain import plainly

WINDOW_S: Final = 600.0
"""Time over which alarms are counted [s]."""
FLOOD: Final = 10
"""As many alarms within it are a flood (ISA-18.2, EEMUA 191)."""
MOST: Final = 500
"""Most alarms of the past that a page lists."""
_ORDER: Final = tuple(Priority)


class AlarmState(StrEnum):
    """State of one alarm."""

    UNACKNOWLEDGED = "unacknowledged"
    """It lasts, and nobody has said that it was seen."""
    ACKNOWLEDGED = "acknowledged"
    """It lasts and was seen."""
    RETURNED = "returned, unacknowledged"
    """It is over, and nobody has said that it was seen."""
    SHELVED = "shelved"
    """A person has taken it out of sight for a time."""
    NORMAL = "normal"
    """It is over and was seen."""


@dataclass(frozen=True, slots=True)
class ListedAlarm:
    """One time that an alarm was raised."""

    alarm: str
    """Identifier."""
    cause: str
    """One sentence."""
    priority: str
    """How soon a person must respond."""
    state: AlarmState
    """Its state."""
    raised_s: float
    """When it was raised [s]."""
    returned_s: float | None = None
    """When it was over [s]; None while it lasts."""
    acknowledged_s: float | None = None
    """When it was acknowledged [s]; None where it was not."""
    acknowledged_by: str = ""
    """By whom."""
    shelved_by: str = ""
    """Who has shelved it; empty where it is not."""
    shelved_until_s: float | None = None
    """Until when [s]."""
    shelved_why: str = ""
    """Why."""
    first: bool = False
    """Whether it was raised while no other lasted: what followed it may follow from it."""
    times: int = 1
    """How often it was raised within the last 10 min, this time included."""


@dataclass(frozen=True, slots=True)
class AlarmList:
    """All alarms at one moment."""

    standing: tuple[ListedAlarm, ...]
    """What an operator must see, the most urgent first."""
    shelved: tuple[ListedAlarm, ...]
    """What is out of sight, by when it is shown again."""
    past: tuple[ListedAlarm, ...]
    """What is over, the latest first; of very many the latest ones."""
    over: int
    """How many are over."""
    within: int
    """How many were raised within the last 10 min."""
    flood: bool
    """Whether that is a flood."""


def alarm_list(entries: Sequence[Entry], at_s: float, most: int | None = MOST) -> AlarmList:
    """The alarms after ``entries``, at ``at_s`` [s]; of what is over ``most``, None for all of it."""
    book = _Book()
    for entry in entries:
        book.take(entry)
    recent = [a for a in book.every if a.raised_s > at_s - WINDOW_S]
    counts: dict[str, int] = {}
    for alarm in recent:
        counts[alarm.alarm] = counts.get(alarm.alarm, 0) + 1
    listed = [replace(a, times=max(1, counts.get(a.alarm, 0))) for a in book.every]
    shelved = [a for a in listed if a.state is AlarmState.SHELVED]
    standing = [a for a in listed if a.state not in (AlarmState.SHELVED, AlarmState.NORMAL)]
    past = [a for a in listed if a.state is AlarmState.NORMAL]
    return AlarmList(
        tuple(sorted(standing, key=_urgency)),
        tuple(sorted(shelved, key=lambda a: a.shelved_until_s or 0.0)),
        tuple(past[::-1][:most]),
        len(past),
        len(recent),
        len(recent) >= FLOOD,
    )


def as_csv(alarms: Iterable[ListedAlarm]) -> str:
    """One row for each of ``alarms``; times in process seconds."""
    out = io.StringIO()
    writer = csv.writer(out)
    names = ("alarm", "priority", "state", "raised_s", "returned_s", "acknowledged_s", "acknowledged_by", "shelved_by",
             "shelved_until_s", "shelved_why", "first", "cause")  # fmt: skip
    writer.writerow(names)
    for alarm in alarms:
        writer.writerow([cell(getattr(alarm, name)) for name in names])
    return out.getvalue()


def cell(value: object) -> object:
    """``value`` as a spreadsheet takes it for a text, and not for a formula."""
    if value is None:
        return ""
    return f"'{value}" if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r") else value


def _urgency(alarm: ListedAlarm) -> tuple[bool, int, float]:
    seen = alarm.state is AlarmState.ACKNOWLEDGED
    return seen, -_ORDER.index(Priority(alarm.priority)), alarm.raised_s


class _Book:
    """Every time that an alarm was raised, in order; of each name one stands at most."""

    def __init__(self) -> None:
        self.every: list[ListedAlarm] = []
        self._latest: dict[str, int] = {}
        self._shelved: dict[str, AlarmShelved] = {}

    def take(self, entry: Entry) -> None:
        event, at_s = entry.event, entry.at_s
        match event:
            case GuardStarted():  # one that begins again raises what lasts once more, and has nothing shelved
                self._shelved.clear()
                for name in self._latest:
                    self._change(name, returned_s=at_s, acknowledged_s=at_s, acknowledged_by="a guard that began again")
            case AlarmRaised():
                lasting = any(self.every[k].returned_s is None for k in self._latest.values())
                cause, priority = plainly(event.cause), event.priority.value
                made = ListedAlarm(event.alarm, cause, priority, AlarmState.UNACKNOWLEDGED, at_s)
                before = self._latest.get(event.alarm)
                if before is not None and self.every[before].acknowledged_s is None:  # the new one stands in its place
                    self._change(event.alarm, returned_s=self.every[before].returned_s or at_s, acknowledged_s=at_s)
                self._latest[event.alarm] = len(self.every)
                self.every.append(replace(made, first=not lasting))
                self._change(event.alarm)
            case AlarmReturned():
                self._change(event.alarm, returned_s=at_s)
            case AlarmAcknowledged():
                self._change(event.alarm, acknowledged_s=at_s, acknowledged_by=event.person)
            case AlarmShelved():
                self._shelved[event.alarm] = event
                self._change(event.alarm)
            case AlarmUnshelved():
                self._shelved.pop(event.alarm, None)
                self._change(event.alarm)

    def _change(self, name: str, **changed: object) -> None:
        """What was raised last under ``name`` is as it was ``changed``."""
        index = self._latest.get(name)
        if index is None:
            return
        old = self.every[index]
        for field, value in changed.items():
            if getattr(old, field) in (None, ""):
                old = replace(old, **{field: value})  # type: ignore[arg-type]
        shelved = self._shelved.get(name)
        over, seen = old.returned_s is not None, old.acknowledged_s is not None
        state = {
            (False, False): AlarmState.UNACKNOWLEDGED,
            (False, True): AlarmState.ACKNOWLEDGED,
            (True, False): AlarmState.RETURNED,
            (True, True): AlarmState.NORMAL,
        }[over, seen]
        held = shelved is not None and state is not AlarmState.NORMAL
        self.every[index] = replace(
            old,
            state=AlarmState.SHELVED if held else state,
            shelved_by=shelved.person if held and shelved else "",
            shelved_until_s=shelved.until_s if held and shelved else None,
            shelved_why=shelved.reason if held and shelved else "",
        )
