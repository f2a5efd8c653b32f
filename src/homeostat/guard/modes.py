"""Modes: who may write, and the lease that goes with it."""

from __future__ import annotations

from homeostat.domain.alarm import Priority
from homeostat.domain.mode import Mode
from homeostat.guard.parts import Parts


class Modes:
    """Holds the plant's mode; the lease is held in modes that write, and in no other."""

    def __init__(self, parts: Parts) -> None:
        """Everything begins in observe."""
        self._parts = parts
        self.mode = Mode.OBSERVE
        """The mode."""

    def enter(self, mode: Mode, now_s: float) -> str:
        """Go over to ``mode``; why not, or empty."""
        parts = self._parts
        if mode.writes and parts.writer.wire is None:
            if parts.lease is None:
                return "this plant is only observed; attach it with a link that can write"
            try:
                parts.writer.wire = parts.lease.take()
            except Exception as broken:  # a link may break in any way
                return f"the plant gives no lease: {broken or type(broken).__name__}"
        if not mode.writes:
            self.leave(now_s)
        self.mode = mode
        return ""

    def leave(self, now_s: float) -> None:
        """Give the lease back: the heartbeat stops, and the plant's own control carries on."""
        parts = self._parts
        if parts.writer.wire is None or parts.lease is None:
            return
        parts.writer.wire = None
        try:
            parts.lease.give_back()
        except Exception as broken:  # without heartbeat the plant sheds all the same
            parts.alarms.raise_("lease", f"the lease cannot be given back: {broken}", Priority.HIGH, now_s)

    def beat(self, now_s: float) -> None:
        """Say that the guard is alive, where it may write."""
        parts = self._parts
        if parts.writer.wire is None or parts.lease is None:
            return
        try:
            parts.lease.beat()
            parts.alarms.return_("heartbeat", now_s)
        except Exception as broken:  # a link may break in any way
            text = f"the heartbeat is not taken: {broken or type(broken).__name__}"
            parts.alarms.raise_("heartbeat", text, Priority.HIGH, now_s)
