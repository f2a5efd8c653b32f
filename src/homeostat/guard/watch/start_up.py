"""Start-up: a phase with limits of its own, which ends once and for all until the plant is started again."""

import math
from collections.abc import Callable

from homeostat.domain.events.guard import StartUpBegan, StartUpEnded
from homeostat.domain.plant.rules import StartUp
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.ports import GuardEvent
from homeostat.domain.snapshot import Snapshot
from homeostat.stl.formula import Formula


class StartUpPhase:
    """Knows when start-up began and whether its limits still hold."""

    def __init__(self, rules: StartUp, machine: StateMachine, note: Callable[[GuardEvent, float], None]) -> None:
        """It begins when a state of start-up is looked at first; ``note`` journals an event at a process time [s]."""
        self._rules, self._machine, self._note = rules, machine, note
        self._since_s = math.nan
        self._over = self._inside = False
        self.overdue = ""
        """What to say of a start-up that has lasted too long and goes on; empty where there is none."""

    def restore(self, since_s: float | None, over: bool, state: str) -> None:
        """Go on after a restart in ``state``: a kill does not make start-up longer."""
        self._since_s, self._over = math.nan if since_s is None else since_s, over
        self._inside = since_s is not None and state in self._rules.states

    def enter(self, state: str, at_s: float) -> None:
        """The plant has entered ``state`` by a step, a request or a start, at process time ``at_s`` [s].

        Only that begins a new start-up. A reset that finds the plant in a state of start-up does not: its limits would
        come back without anybody having started anything.
        """
        inside = state in self._rules.states
        if inside and not self._inside:
            self._begin(state, at_s)
        elif not inside:
            self._leave(state, at_s)
        self._inside = inside

    def holds(self, now_s: float, readings: Snapshot | None, state: str) -> bool:
        """Whether the limits of start-up hold at ``now_s`` [s]: in its states, until the plant could leave them.

        Whether the step that leaves them can be written is another matter: wider limits must not wait for it. They
        wait for nothing longer than the tables allow.
        """
        if state not in self._rules.states:
            self._leave(state, now_s)
            self._inside = False
            return False
        if math.isnan(self._since_s):
            self._begin(state, now_s)
        longest_s = self._rules.longest_s.get(state, math.inf)
        if not self._over and not 0.0 <= now_s - self._since_s <= longest_s:
            self.overdue = f"start-up is not over after {longest_s:g} s; every limit counts from now on"
            self._end(state, self.overdue, now_s)
        way = "" if self._over or readings is None else self._way_out(readings, state)
        if way:
            self._end(state, way, now_s)
        return not self._over

    def _way_out(self, readings: Snapshot, state: str) -> str:
        """Which transition could be taken out of start-up now; empty for none."""
        for t in self._machine.transitions:
            leads_out = t.source == state and not t.on_decision and t.target not in self._rules.states
            if leads_out and _holds(t.guard, readings):
                return f"it could be left: {t.guard.text!r} holds ({t.name})"
        return ""

    def _begin(self, state: str, at_s: float) -> None:
        self._since_s, self._over, self._inside, self.overdue = at_s, False, True, ""
        self._note(StartUpBegan(state, at_s), at_s)

    def _leave(self, state: str, at_s: float) -> None:
        self.overdue = ""
        if self._inside and not self._over:
            self._end(state, "it was left", at_s)

    def _end(self, state: str, reason: str, at_s: float) -> None:
        self._over = True
        self._note(StartUpEnded(state, reason), at_s)


def _holds(guard: Formula, readings: Snapshot) -> bool:
    """Whether ``guard`` is known to hold; one that cannot be judged at one point does not."""
    try:
        return guard.holds(readings.values)
    except Exception:  # a broken guard must not keep the limits from being watched
        return False
