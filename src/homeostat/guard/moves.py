"""Moves: what somebody else has changed is respected, and what of ours arrives too late is put right."""

from __future__ import annotations

from homeostat.domain.alarm import Priority
from homeostat.domain.guard_events import Cause
from homeostat.domain.mode import Mode, Side
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.latch import Latch
from homeostat.guard.memory import PUT_RIGHT
from homeostat.guard.parts import Parts
from homeostat.guard.service import Moved
from homeostat.guard.writer import Write


class Moves:
    """Notices within one tick that a target is not the guard's any more."""

    def __init__(self, parts: Parts, latch: Latch) -> None:
        """``latch``: what arrives late is put right only while a fallback is latched."""
        self._parts, self._latch = parts, latch
        self._late: dict[str, Command] = {}

    def notice(self, now_s: float, readings: Snapshot, mode: Mode) -> None:
        """Judge every target that the plant tells."""
        parts, latched = self._parts, self._latch.reason is not None
        if not parts.tenure.held and now_s < parts.tenure.given_back_s + parts.settings.again_s:
            parts.service.track(readings)  # the plant's own control has taken over
            return
        moves = parts.service.moved(readings, self._pending)
        parts.service.expect(parts.writer.ramped(readings))
        for moved in moves:
            ours = latched and moved.tag in parts.service.tags
            if ours and parts.writer.late(moved.tag, moved.now):
                self._late[moved.tag] = Command(moved.tag, moved.before, parts.rules.tags[moved.tag].rate_limit)
                text = f"a write that was given up has moved {moved.tag!r} after all"
                parts.alarms.say(f"late:{moved.tag}", text, Priority.HIGH, now_s)
            elif parts.rules.recipe is Side.GUARD or mode.writes:
                self._take_out(moved, now_s)
        self._put_right(now_s, latched)

    def _pending(self, tag: str, target: float | None) -> bool:
        """Whether ``tag`` is being written and may have come to ``target`` by that."""
        writer = self._parts.writer
        if tag not in writer.pending:
            return False
        flying = writer.flying
        return (flying is not None and flying.cause is Cause.FALLBACK) or writer.expects(tag, target)

    def _take_out(self, moved: Moved, now_s: float) -> None:
        text = f"somebody changed {moved.tag!r} from {_shown(moved.before)} to {_shown(moved.now)}"
        self._parts.writer.leave(moved.tag)
        if self._parts.service.change(moved.tag, False, "", text, now_s):
            self._parts.alarms.raise_(f"moved:{moved.tag}", text, Priority.MEDIUM, now_s)

    def _put_right(self, now_s: float, latched: bool) -> None:
        if not latched:
            self._late.clear()
        elif self._late and self._parts.writer.flying is None:
            commands, self._late = tuple(self._late.values()), {}
            self._parts.writer.begin(
                Write(Cause.FALLBACK, PUT_RIGHT, commands, self._parts.sequencer.state), now_s
            )  # fmt: skip


def _shown(target: float | None) -> str:
    return "automatic" if target is None else f"{target:g}"
