"""Troubles: what is broken beside the guard, as alarms that cannot be taken for the guard's own."""

from __future__ import annotations

from homeostat.domain.alarm import Priority
from homeostat.domain.observation import Settled, Trouble
from homeostat.guard.texts import brief
from homeostat.guard.watch.alarms import Alarms

MOST = 50
"""Most troubles that last at the same time."""
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
        """Raise the alarm; ValueError where too many last already."""
        name = _own(trouble.name)
        if name not in self._lasting and len(self._lasting) >= MOST:
            raise ValueError(f"more than {MOST} troubles at once: {brief(trouble.cause)}")
        self._lasting.add(name)
        self._alarms.raise_(name, brief(trouble.cause), Priority.HIGH, now_s)

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
