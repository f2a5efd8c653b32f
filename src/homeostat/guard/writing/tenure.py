"""Tenure: the lease on the plant with its heartbeat, taken again where it was lost; and modes: who may write."""

import math
from collections.abc import Callable

from homeostat.domain.alarm import Priority
from homeostat.domain.events.writes import LeaseLost, LeaseTried
from homeostat.domain.mode import Mode
from homeostat.domain.ports import GuardEvent, Lease
from homeostat.guard.settings import GuardSettings
from homeostat.guard.texts import said
from homeostat.guard.watch.alarms import Alarms
from homeostat.guard.writing.bounded import BoundedLease
from homeostat.guard.writing.writer import Writer

LONGEST_S = 600.0
"""Longest wait between two attempts at a lost lease [s]."""


class Tenure:
    """Takes the lease for the writer and gives it back; a link that breaks over it is an alarm.

    A lease is lost where the heartbeat is not taken or the plant says that it is over. Nothing is written on a lost
    wire. The lease counts as lost until the plant was read with the new one.
    """

    def __init__(
        self,
        lease: Lease | None,
        writer: Writer,
        alarms: Alarms,
        note: Callable[[GuardEvent, float], None],
        settings: GuardSettings,
    ) -> None:
        """``lease``: the right to write, None where the plant is only observed; ``note`` journals at a time [s]."""
        self._lease, self._writer, self._alarms = lease, writer, alarms
        self._note, self._settings = note, settings
        self._attempts, self._tried_s = 0, -math.inf
        self.lost = ""
        """How the loss of the lease was noticed; empty where it was not lost, or the plant was read since."""
        self.taken_s = -math.inf
        """When it was taken last [s]."""
        self.given_back_s = -math.inf
        """When it was given back last [s]."""

    @property
    def held(self) -> bool:
        """Whether the guard may write."""
        return self._writer.wire is not None

    @property
    def awaited(self) -> bool:
        """Whether a lease that was asked for is still under way; nobody asks for another one meanwhile."""
        return isinstance(self._lease, BoundedLease) and self._lease.awaited

    @property
    def arrived(self) -> bool:
        """Whether a lease that somebody waited for in vain can be taken now."""
        return isinstance(self._lease, BoundedLease) and self._lease.arrived and not self.held

    def take(self, now_s: float) -> str:
        """Take the lease, once more where it is held; why not, or empty."""
        if self._lease is None:
            return "this plant is only observed; attach it with a link that can write"
        objection = ""
        try:
            self._writer.attach(self._lease.take())
        except BaseException as broken:  # a link may break in any way
            objection = f"the plant gives no lease: {said(broken)}"
            if self.awaited:
                objection += f"; it may take {self._settings.lease_within_s:g} s"
        else:
            self.taken_s = now_s
        if self.lost:
            self._attempts, self._tried_s = self._attempts + 1, now_s
            self._note(LeaseTried(self._attempts, not objection, objection), now_s)
        return objection

    def forget(self) -> None:
        """A person wants the lease: how often it was tried for before has no say in how soon it is tried again."""
        self._attempts = 0

    def retake(self, now_s: float) -> bool:
        """Take a lost lease again: at once and in the ticks that follow, then after waits that double each time.

        Whether it was given now. An attempt that is under way is awaited, and counts once it has come. Whoever else
        wants the lease has it in the end; a person may order a writing mode, which takes it whoever has it.
        """
        if not self.lost or self.held:
            return False
        if self.awaited:
            return self.arrived and not self.take(now_s)
        vain = self._attempts - self._settings.attempts
        wait_s = min(self._settings.again_s * 2.0 ** min(vain, 20), LONGEST_S)
        due = now_s > self._tried_s and (vain < 0 or now_s >= self._tried_s + wait_s)
        return due and not self.take(now_s)

    def check(self, now_s: float) -> None:
        """Ask the plant whether the lease lasts; a link that cannot say so has its heartbeat.

        A lease that is under way for too long is an alarm.
        """
        late = self._lease.overdue if isinstance(self._lease, BoundedLease) else ""
        if late:
            self._alarms.raise_("lease:late", late, Priority.HIGH, now_s)
        else:
            self._alarms.return_("lease:late", now_s)
        wire = self._writer.wire
        try:
            over = wire is not None and bool(wire.void)
        except BaseException as broken:  # a link may break in any way
            said(broken)
            return
        if over:
            self._lose("the plant says that the lease is over", now_s)

    def settle(self, now_s: float) -> None:
        """The plant was read with the new lease, and everybody knows what has become of it."""
        self.lost = ""
        self._alarms.return_("heartbeat", now_s)

    def give_back(self, now_s: float) -> None:
        """The heartbeat stops, and the plant's own control carries on; one that is lost is not wanted any more."""
        if self.lost:
            self.given_back_s = now_s
            self.settle(now_s)
        lease = self._in_use
        if lease is None:
            return
        self._writer.detach()
        self.given_back_s = now_s
        try:
            lease.give_back()
        except BaseException as broken:  # without heartbeat the plant sheds all the same
            text = f"the lease cannot be given back: {said(broken)}"
            self._alarms.raise_("lease", text, Priority.HIGH, now_s)
        else:
            self._alarms.return_("lease", now_s)

    def beat(self, now_s: float) -> None:
        """Say that the guard is alive, where it may write; a heartbeat that is not taken is a lost lease."""
        lease = self._in_use
        if lease is None:
            return
        try:
            lease.beat()
        except BaseException as broken:  # a link may break in any way
            self._lose(f"the heartbeat is not taken: {said(broken)}", now_s)

    @property
    def _in_use(self) -> Lease | None:
        return self._lease if self.held else None

    def _lose(self, reason: str, now_s: float) -> None:
        if now_s - self.taken_s >= self._settings.again_s:  # it has lasted; else somebody else wants it, too
            self._attempts = 0
        self._writer.cut()
        self.lost = reason
        self._note(LeaseLost(reason), now_s)
        self._alarms.raise_("heartbeat", reason, Priority.HIGH, now_s)


class Modes:
    """Holds the plant's mode; the lease is held in modes that write, and by a fallback until it stands."""

    def __init__(self, tenure: Tenure) -> None:
        """Everything begins in observe."""
        self._tenure = tenure
        self._wanted: Mode | None = None
        self.mode = Mode.OBSERVE
        """The mode."""

    def enter(self, mode: Mode, now_s: float) -> str:
        """Go over to ``mode``; why not, or empty. Where it does not write, :meth:`settle` gives the lease back.

        One that writes takes the lease also where it seems to be held: it may have been lost without a word.
        """
        self._tenure.forget()
        objection, self._wanted = self._tenure.take(now_s) if mode.writes else "", None
        if not objection:
            self.mode = mode
        return objection

    def begin(self, mode: Mode, now_s: float) -> str:
        """Begin in ``mode``; why not, or empty. Where the lease is under way, :meth:`late` enters it later."""
        objection = self.enter(mode, now_s)
        self._wanted = mode if objection and self._tenure.awaited else None
        return objection

    def late(self, now_s: float) -> Mode | None:
        """The mode that it was to begin in, where that is entered now, because the lease has come."""
        wanted = self._wanted if self._tenure.arrived else None
        return wanted if wanted is not None and not self.enter(wanted, now_s) else None

    def settle(self, now_s: float, sending: bool) -> None:
        """Give the lease back in a mode that does not write, unless a fallback is still being sent (``sending``)."""
        if not self.mode.writes and not sending:
            self._tenure.give_back(now_s)
