"""Alarms: raised once, acknowledged by a person, returned when the condition ends (ISA-18.2); others' troubles, too."""

from collections.abc import Callable
from dataclasses import replace

from homeostat.domain.alarm import Alarm, Priority
from homeostat.domain.events.people import AlarmAcknowledged, AlarmRaised, AlarmReturned
from homeostat.domain.observation import Settled, Trouble
from homeostat.domain.ports import GuardEvent
from homeostat.guard.texts import brief


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

    def lists(self, name: str) -> bool:
        """Whether alarm ``name`` is in the list, be it over or not."""
        return name in self._standing

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


MOST = 50
"""Most troubles that last at the same time."""
LISTED = 500
"""Most troubles in the list, those included that are over and that nobody has seen: a plant is attached for months."""
LONGEST_NAME = 100
"""Most characters of the name of a trouble."""
OTHERS = ("recovery", "source")
"""Who has troubles of their own; the names of the guard's alarms begin otherwise."""


class Troubles:
    """Raises and ends the alarms of whoever stands beside the guard."""

    def __init__(self, alarms: Alarms) -> None:
        """Nobody has any trouble yet."""
        self._alarms = alarms
        self._lasting: set[str] = set()

    def begin(self, trouble: Trouble, now_s: float) -> None:
        """Raise the alarm; ValueError where too many last already, or wait to be seen."""
        name = _own(trouble.name)
        if (
            not self._alarms.lists(name)
            and sum(a.id.partition(":")[0] in OTHERS for a in self._alarms.standing) >= LISTED
        ):
            raise ValueError(f"more than {LISTED} troubles that nobody has acknowledged: {brief(trouble.cause)}")
        if name not in self._lasting and len(self._lasting) >= MOST:
            raise ValueError(f"more than {MOST} troubles at once: {brief(trouble.cause)}")
        self._lasting.add(name)
        priority = trouble.priority if isinstance(trouble.priority, Priority) else Priority.HIGH
        self._alarms.raise_(name, brief(trouble.cause), priority, now_s)

    def end(self, settled: Settled, now_s: float) -> None:
        """The trouble is over, where there is one of that name."""
        name = _own(settled.name)
        if name in self._lasting:
            self._lasting.remove(name)
            self._alarms.return_(name, now_s)


def _own(name: str) -> str:
    """The name of the alarm: that of a trouble begins with whoever has it."""
    short = brief(name, LONGEST_NAME)
    return short if short.partition(":")[0] in OTHERS else f"{OTHERS[0]}:{short}"
