"""Thinking time: how long it took by the wall clock; no event of a run says so."""

from collections.abc import Callable

from homeostat.domain.events.recovery import Noticed
from homeostat.domain.events.trips import FallbackActivated
from homeostat.journal import Event
from homeostat.record.run_record import RunRecord


class ThinkingTime:
    """Follows a trace and reads the clock when something is noticed and when something is first done about it."""

    def __init__(self, record: RunRecord, thought_s: Callable[[], float]) -> None:
        """``record`` takes each event before this does; ``thought_s``: wall-clock seconds of thinking so far [s]."""
        self._record, self._thought_s = record, thought_s
        self._before_notice_s = 0.0
        self._until_action_s: float | None = None

    def __call__(self, event: Event, at_s: float) -> None:
        """Take one event."""
        if self._until_action_s is not None:
            return
        if isinstance(event, Noticed):
            self._before_notice_s = self._thought_s()
        if isinstance(event, FallbackActivated) or self._record.released:
            self._until_action_s = self._thought_s() - self._before_notice_s

    @property
    def total_s(self) -> float:
        """Wall-clock seconds of all thinking [s]."""
        return self._thought_s()

    @property
    def decision_s(self) -> float:
        """Those from the notice that led to the first action until that action; all where nothing was done [s]."""
        return self.total_s if self._until_action_s is None else self._until_action_s
