"""Shelved alarms: out of an operator's sight for a stated time and reason (ISA-18.2); what they watch is watched."""

from collections.abc import Callable

from homeostat.domain.alarm import Priority
from homeostat.domain.events.people import AlarmShelved, AlarmUnshelved
from homeostat.domain.mode import PersonCommand
from homeostat.domain.ports import GuardEvent
from homeostat.guard.watch.alarms import Alarms

LONGEST_S = 28_800.0
"""Longest that an alarm is shelved [s]: whoever comes for the next shift sees it."""


class Shelf:
    """What people have shelved; a guard that begins again has nothing shelved."""

    def __init__(self, alarms: Alarms, note: Callable[[GuardEvent, float], None]) -> None:
        """``note`` journals an event at a process time [s]."""
        self._alarms, self._note = alarms, note
        self._until_s: dict[str, float] = {}

    def shelve(self, command: PersonCommand, now_s: float) -> str:
        """Shelve the alarm that ``command`` names; why not, or empty."""
        seconds: object = command.seconds
        if not (type(seconds) in (int, float) and 0.0 < command.seconds <= LONGEST_S):
            return f"an alarm is shelved for more than 0 and at most {LONGEST_S:g} s, not for {seconds!r} s"
        alarm = next((a for a in self._alarms.standing if a.id == command.subject), None)
        if alarm is None:
            return f"there is no alarm {command.subject!r}"
        if alarm.priority is Priority.CRITICAL:
            return f"alarm {alarm.id!r} is critical; it is not shelved"
        until_s = now_s + command.seconds
        self._until_s[alarm.id] = until_s
        self._note(AlarmShelved(alarm.id, command.person, command.reason, until_s), now_s)
        return ""

    def unshelve(self, command: PersonCommand, now_s: float) -> str:
        """Show the alarm again that ``command`` names; why not, or empty."""
        if self._until_s.pop(command.subject, None) is None:
            return f"alarm {command.subject!r} is not shelved"
        self._note(AlarmUnshelved(command.subject, command.person), now_s)
        return ""

    def expire(self, now_s: float) -> None:
        """Show again what was shelved until ``now_s`` [s]."""
        for name in [name for name, until_s in self._until_s.items() if until_s <= now_s]:
            del self._until_s[name]
            self._note(AlarmUnshelved(name, ""), now_s)
