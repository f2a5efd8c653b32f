"""Tenure: the lease on the plant, and the heartbeat that goes with it."""

from __future__ import annotations

import math

from homeostat.domain.alarm import Priority
from homeostat.domain.ports import Lease
from homeostat.guard.alarms import Alarms
from homeostat.guard.writer import Writer


class Tenure:
    """Takes the lease for the writer and gives it back; a link that breaks over it is an alarm."""

    def __init__(self, lease: Lease | None, writer: Writer, alarms: Alarms) -> None:
        """``lease``: the right to write; None where the plant is only observed."""
        self._lease, self._writer, self._alarms = lease, writer, alarms
        self.given_back_s = -math.inf
        """When it was given back last [s]."""

    @property
    def held(self) -> bool:
        """Whether the guard may write."""
        return self._writer.wire is not None

    def take(self) -> str:
        """Take the lease, once more where it is held; why not, or empty."""
        if self._lease is None:
            return "this plant is only observed; attach it with a link that can write"
        try:
            self._writer.wire = self._lease.take()
        except Exception as broken:  # a link may break in any way
            return f"the plant gives no lease: {str(broken) or type(broken).__name__}"
        return ""

    def give_back(self, now_s: float) -> None:
        """The heartbeat stops, and the plant's own control carries on."""
        lease = self._in_use
        if lease is None:
            return
        self._writer.wire, self.given_back_s = None, now_s
        try:
            lease.give_back()
        except Exception as broken:  # without heartbeat the plant sheds all the same
            text = f"the lease cannot be given back: {str(broken) or type(broken).__name__}"
            self._alarms.raise_("lease", text, Priority.HIGH, now_s)
        else:
            self._alarms.return_("lease", now_s)

    def beat(self, now_s: float) -> None:
        """Say that the guard is alive, where it may write."""
        lease = self._in_use
        if lease is None:
            self._alarms.return_("heartbeat", now_s)
            return
        try:
            lease.beat()
        except Exception as broken:  # a link may break in any way
            text = f"the heartbeat is not taken: {str(broken) or type(broken).__name__}"
            self._alarms.raise_("heartbeat", text, Priority.HIGH, now_s)
        else:
            self._alarms.return_("heartbeat", now_s)

    @property
    def _in_use(self) -> Lease | None:
        return self._lease if self.held else None
