"""Alarms of the guard: raised once, acknowledged by a person, returned when the condition ends (ISA-18.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from homeostat.domain.alarm import Alarm, Priority
from homeostat.domain.events.people import AlarmAcknowledged, AlarmRaised, AlarmReturned
from homeostat.domain.ports import GuardEvent


class Alarms:
    """The list of standing alarms; one that has returned and was acknowledged leaves it."""

    def __init__(self, note: Callable[[GuardEvent, float], None]) -> None:
        """``note`` journals an event at a process time [s]."""
        self._note = note
        self._standing: dict[str, Alarm] = {}

    @property
    def standing(self) -> tuple[Alarm, ...]:
        """Alarms that last or that nobody has seen, the oldest first."""
        return tuple(self._standing.values())

    def lasts(self, name: str) -> bool:
        """Whether the condition of alarm ``name`` lasts."""
        alarm = self._standing.get(name)
        return alarm is not None and alarm.returned_s is None

    def raise_(self, name: str, cause: str, priority: Priority, at_s: float) -> None:
        """Raise alarm ``name``; one that lasts is not raised again."""
        if self.lasts(name):
            return
        self._standing[name] = Alarm(name, cause, priority, at_s)
        self._note(AlarmRaised(name, cause, priority), at_s)

    def hold(self, name: str, cause: str, at_s: float) -> None:
        """Alarm ``name`` lasts as long as there is a ``cause``."""
        if cause:
            self.raise_(name, cause, Priority.HIGH, at_s)
        else:
            self.return_(name, at_s)

    def say(self, name: str, cause: str, priority: Priority, at_s: float) -> None:
        """Raise alarm ``name`` of something that is over already: it stands until somebody has seen it."""
        self.raise_(name, cause, priority, at_s)
        self.return_(name, at_s)

    def return_(self, name: str, at_s: float) -> None:
        """The condition of alarm ``name`` has ended."""
        alarm = self._standing.get(name)
        if alarm is None or alarm.returned_s is not None:
            return
        self._note(AlarmReturned(name), at_s)
        if alarm.acknowledged_by is None:
            self._standing[name] = replace(alarm, returned_s=at_s)
        else:
            del self._standing[name]

    def acknowledge(self, name: str, person: str, at_s: float) -> bool:
        """``person`` has seen alarm ``name``; False where there is none."""
        alarm = self._standing.get(name)
        if alarm is None:
            return False
        self._note(AlarmAcknowledged(name, person), at_s)
        if alarm.returned_s is None:
            self._standing[name] = replace(alarm, acknowledged_by=person)
        else:
            del self._standing[name]
        return True
