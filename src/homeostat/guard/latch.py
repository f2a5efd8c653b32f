"""The latch: a fallback that was activated acts until it stands; nothing else is released before a person's reset."""

from __future__ import annotations

from homeostat.domain.alarm import Priority
from homeostat.domain.guard_events import (
    Cause,
    FallbackSkipped,
    FallbackStands,
    FellBack,
    Latched,
    SequenceLoaded,
    Shed,
    StepLoaded,
)
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback import Chosen, Fallbacks
from homeostat.guard.parts import Parts
from homeostat.guard.writer import Progress, Write


class Latch:
    """Activates fallbacks: the armed one, then the next, then the plant's own shed."""

    def __init__(self, parts: Parts) -> None:
        """The strategies stand in the order of the tables until recovery ranks them."""
        self._parts = parts
        self.fallbacks = Fallbacks(parts.rules)
        """The strategies."""
        self.reason: str | None = None
        """Why a fallback acted; None while none has."""
        self._acting: Chosen | None = None
        self._loaded = self._standing = False
        self._again_s: float | None = None

    @property
    def standing(self) -> bool:
        """Whether the plant was read back and holds every target of the fallback."""
        return self._standing

    def activate(self, reason: str, now_s: float, readings: Snapshot | None) -> None:
        """Latch and have the first strategy act now, whatever is under way."""
        if self.reason is not None:
            return
        self.reason = reason
        self._parts.alarms.raise_("latched", reason, Priority.CRITICAL, now_s)
        self._parts.writer.overtake(now_s, "a fallback acts")
        self._parts.sequencer.stop()
        self.fallbacks.begin()
        self._act(now_s, readings)
        self._parts.note(Latched(reason), now_s)

    def escalate(self, reason: str, now_s: float, readings: Snapshot | None) -> None:
        """Another limit is violated although a fallback has acted: have the next strategy act."""
        self._parts.note(FallbackSkipped(self._name, reason), now_s)
        self._parts.writer.overtake(now_s, "another fallback acts")
        self._act(now_s, readings)

    def hold(self, reason: str) -> None:
        """Be latched again after a restart, before the plant was read."""
        self.reason = reason

    def restore(self, strategy: str, now_s: float, readings: Snapshot | None) -> None:
        """Go on after a restart: ``strategy`` is sent again; empty where it is known to stand."""
        self._parts.alarms.raise_("latched", self.reason or "", Priority.CRITICAL, now_s)
        self._standing = not strategy
        if strategy:
            self.fallbacks.arm((strategy,), readings, self._parts.service.tags)
            self.fallbacks.begin()
            self._act(now_s, readings)

    def reset(self) -> None:
        """Forget what was activated."""
        self.reason, self._acting, self._again_s = None, None, None
        self._loaded = self._standing = False
        self.fallbacks = Fallbacks(self._parts.rules)

    def follow(self, progress: Progress | None, now_s: float, readings: Snapshot | None) -> None:
        """Take note of how far the fallback's write has come, and begin the next one where it has failed."""
        if self.reason is None:
            return
        taken = self._parts.writer.accepted or progress is Progress.CONFIRMED
        if self._acting is not None and not self._loaded and taken:
            self._load(self._acting.actions, now_s)
        if progress is Progress.CONFIRMED and self._acting is not None:
            self._stands(self._acting, now_s)
        elif progress is Progress.FAILED and self._acting is not None:
            self._disobeyed(now_s, readings)
        elif self._again_s is not None and now_s >= self._again_s:
            self.fallbacks.begin()
            self._act(now_s, readings)

    @property
    def _name(self) -> str:
        return "" if self._acting is None else self._acting.strategy.name

    def _act(self, now_s: float, readings: Snapshot | None) -> None:
        """Write the next strategy that passes its checks; none stops a trip, so the plant's own shed is the last."""
        parts, self._again_s, self._standing = self._parts, None, False
        self._lease(now_s)
        while (strategy := self.fallbacks.take()) is not None:
            chosen = self.fallbacks.checked(strategy, readings, parts.service.tags)
            if isinstance(chosen, str):
                parts.note(FallbackSkipped(strategy.name, chosen), now_s)
                parts.alarms.raise_(f"fallback:{strategy.name}", chosen, Priority.HIGH, now_s)
                continue
            self._acting, self._loaded = chosen, False
            actions = chosen.actions
            parts.writer.begin(Write.of(Cause.FALLBACK, strategy.name, actions), now_s)
            parts.note(FellBack(strategy.name, actions.commands, self.reason or ""), now_s)
            self.follow(None, now_s, readings)
            return
        self._shed(now_s)

    def _lease(self, now_s: float) -> None:
        """Take the lease again where it was given back."""
        writer, lease = self._parts.writer, self._parts.lease
        if writer.wire is None and lease is not None:
            try:
                writer.wire = lease.take()
            except Exception as broken:  # the write fails then, and that is an alarm of its own
                self._parts.alarms.raise_("lease", f"the plant gives no lease: {broken}", Priority.HIGH, now_s)

    def _load(self, actions: ActionSet, now_s: float) -> None:
        self._loaded = True
        self._parts.sequencer.load(actions, now_s, aborting=True)
        self._parts.note(loaded(self._name, actions, aborting=True), now_s)

    def _stands(self, acting: Chosen, now_s: float) -> None:
        self._standing = True
        self._parts.service.expect(acting.actions.commands)
        self._parts.note(FallbackStands(acting.strategy.name), now_s)
        for name in (f"fallback:{acting.strategy.name}", "shed"):
            self._parts.alarms.return_(name, now_s)
        self._acting = None

    def _disobeyed(self, now_s: float, readings: Snapshot | None) -> None:
        reason = self._parts.writer.error or "the plant does not hold every target after every attempt"
        self._parts.note(FallbackSkipped(self._name, reason), now_s)
        self._parts.alarms.raise_(f"fallback:{self._name}", f"not obeyed: {reason}", Priority.CRITICAL, now_s)
        self._acting = None
        self._act(now_s, readings)

    def _shed(self, now_s: float) -> None:
        """Stop the heartbeat; strategies are tried again after a while, because the plant may obey again."""
        parts = self._parts
        self._acting, self._again_s = None, now_s + parts.settings.again_s
        reason = "no fallback passes its checks and is obeyed"
        if not parts.alarms.lasts("shed"):
            parts.note(Shed(reason), now_s)
        parts.alarms.raise_("shed", f"{reason}; the plant's own control goes on", Priority.CRITICAL, now_s)
        parts.writer.wire = None
        if parts.lease is not None:
            try:
                parts.lease.give_back()
            except Exception as broken:  # without heartbeat the plant sheds all the same
                parts.alarms.raise_("lease", f"the lease cannot be given back: {broken}", Priority.HIGH, now_s)


def loaded(source: str, actions: ActionSet, aborting: bool) -> SequenceLoaded:
    """The event of a sequencer that goes on with ``actions``."""
    steps = tuple(StepLoaded(s.transition.name, s.commands) for s in actions.then)
    return SequenceLoaded(source, actions.target, steps, aborting)
