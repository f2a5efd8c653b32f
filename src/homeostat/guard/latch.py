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
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback import Chosen, Fallbacks
from homeostat.guard.flight import Progress, Write
from homeostat.guard.parts import Parts


class Latch:
    """Activates fallbacks: the armed one, then the next, then the plant's own shed."""

    def __init__(self, parts: Parts) -> None:
        """The strategies stand in the order of the tables until recovery ranks them."""
        self._parts = parts
        self.fallbacks = Fallbacks(parts.rules)
        """The strategies."""
        self.reason: str | None = None
        """Why a fallback acted; None while none has."""
        self.standing = False
        """Whether the plant was read back and holds every target of the fallback."""
        self.strategy: FallbackStrategy | None = None
        """The strategy that acted last; None while none has."""
        self._acting: Chosen | None = None
        self._loaded = self._held = False
        self._again_s: float | None = None

    @property
    def forced(self) -> frozenset[str]:
        """Tags that the fallback writes even where they are out of service."""
        return frozenset() if self.strategy is None else self.strategy.forced

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

    def escalate(self, limit: str, reason: str, now_s: float, readings: Snapshot | None) -> bool:
        """``limit`` is violated although a fallback stands: the next strategy that passes its checks acts.

        False where there is none; what stands is better than what the plant does by itself.
        """
        chosen = self._next(now_s, readings, limit)
        if chosen is None:
            return False
        self._parts.writer.overtake(now_s, "another fallback acts")
        self._parts.sequencer.stop()
        self._write(chosen, reason, now_s, readings)
        return True

    def give_way(self, tag: str, now_s: float, readings: Snapshot | None, violated: bool) -> None:
        """Somebody has moved ``tag``, to which a fallback is being sent: it is theirs, unless the row says otherwise.

        What else the strategy writes is still sent. Where a hard limit is ``violated`` all the same, or nothing is
        left to send, the strategy has failed, and the next one that passes its checks acts. Where there is none, what
        is left of this one is better than what the plant does by itself.
        """
        writer, acting = self._parts.writer, self._acting
        flying = writer.flying
        if flying is None or flying.cause is not Cause.FALLBACK or tag in self.forced:
            return
        if tag not in {c.tag for c in flying.commands}:
            return
        left, reason = writer.without(tag), f"somebody has moved {tag!r} meanwhile"
        following = self._next(now_s, readings) if acting is not None and (violated or not left) else None
        if left and following is None:
            return
        writer.overtake(now_s, reason)
        if acting is not None:
            self._failed(acting, reason, now_s)
        if following is not None:
            self._parts.sequencer.stop()
            self._write(following, self.reason or "", now_s, readings)
        elif acting is not None:
            self._shed(now_s)

    def again(self, now_s: float) -> None:
        """Send everything once more: what was being sent has left something out for no reason."""
        if self.reason is not None and not self.standing:
            self._parts.writer.overtake(now_s, "the fallback begins again")
            self._acting, self._again_s = None, None

    def give_up(self, limit: str, reason: str, now_s: float, readings: Snapshot | None) -> None:
        """What stands does not help: it acts no more before a reset, but the next one, and at last the plant's shed."""
        if self.strategy is not None:
            self.fallbacks.spend(self.strategy.name)
        if not self.escalate(limit, reason, now_s, readings):
            self.standing = False
            self._parts.sequencer.stop()
            self._shed(now_s)

    def hold(self, reason: str, strategy: str, spent: frozenset[str]) -> None:
        """Be latched again after a restart, before the plant was read; ``strategy`` had acted last.

        ``spent`` are the strategies that do not help.
        """
        self.reason = reason
        self.strategy = next((s for s in self._parts.rules.fallbacks if s.name == strategy), None)
        for name in spent:
            self.fallbacks.spend(name)
        self.standing = self._held = True

    def restore(self, strategy: str, now_s: float, readings: Snapshot | None) -> None:
        """Go on after a restart: ``strategy`` is sent again; empty where it is known to stand."""
        self._parts.alarms.raise_("latched", self.reason or "", Priority.CRITICAL, now_s)
        if not self._held:
            return  # another limit was violated before the plant was read, and a fallback is being sent
        acted = self.strategy.name if self.strategy is not None else ""
        vain = acted in self.fallbacks.spent
        self._held, self.standing = False, bool(acted) and not strategy and not vain
        self.fallbacks.arm((strategy or acted,) if strategy or acted else (), readings, self._parts.service.tags)
        self.fallbacks.begin()
        if self.standing:
            self.fallbacks.take()  # what stands is not the next one
        else:
            self._act(now_s, readings)

    def reset(self, now_s: float) -> None:
        """Forget what was activated, and the alarms of it."""
        parts = self._parts
        self.reason, self.strategy, self._acting, self._again_s = None, None, None, None
        self._loaded = self.standing = False
        self.fallbacks = Fallbacks(parts.rules)
        parts.writer.overtake(now_s, "the latch was reset")
        parts.writer.forget()
        for name in ("latched", "shed", "fallbacks", *(f"fallback:{s.name}" for s in parts.rules.fallbacks)):
            parts.alarms.return_(name, now_s)

    def allowed(self, commands: tuple[Command, ...]) -> tuple[Command, ...]:
        """Those of ``commands`` that a fallback's step may write: no tag that a person has, unless its row says so."""
        if self.reason is None:
            return commands
        return tuple(c for c in commands if c.tag in self._parts.service.tags or c.tag in self.forced)

    def follow(self, write: Write | None, progress: Progress | None, now_s: float, readings: Snapshot | None) -> None:
        """Take note of how far ``write`` has come, and begin the next strategy where a fallback has failed."""
        if self.reason is None:
            return
        parts, ours = self._parts, write is not None and write.cause is Cause.FALLBACK
        acting = self._acting if ours else None
        if acting is not None and not self._loaded and (parts.writer.accepted or progress is Progress.CONFIRMED):
            self._load(acting, now_s)
        if acting is not None and progress is Progress.CONFIRMED:
            self._stands(acting, now_s)
        elif ours and progress is Progress.FAILED:
            self._disobeyed(now_s, readings)
        elif ours and parts.writer.broken:
            parts.tenure.take(now_s)  # perhaps the lease was lost; the next attempt has a new one
        elif self._due(now_s):
            self.fallbacks.begin()
            self._act(now_s, readings)

    def _due(self, now_s: float) -> bool:
        """Whether it is time to act: nothing stands, nothing is being sent, and the last vain round is over."""
        if self.standing or self._parts.writer.flying is not None:
            return False
        return self._again_s is None or now_s >= self._again_s

    def _act(self, now_s: float, readings: Snapshot | None) -> None:
        """Write the next strategy that passes its checks; none stops a trip, so the plant's own shed is the last."""
        self._again_s, self.standing = None, False
        chosen = self._next(now_s, readings)
        if chosen is None:
            self._shed(now_s)
        else:
            self._write(chosen, self.reason or "", now_s, readings)

    def _next(self, now_s: float, readings: Snapshot | None, limit: str = "") -> Chosen | None:
        """The next strategy that passes its checks, best one that brings ``limit`` back; None where none does."""
        parts = self._parts
        while (strategy := self.fallbacks.take(limit)) is not None:
            chosen = self.fallbacks.checked(strategy, readings, parts.service.tags)
            if isinstance(chosen, Chosen):
                return chosen
            parts.note(FallbackSkipped(strategy.name, chosen), now_s)
            parts.alarms.raise_(f"fallback:{strategy.name}", chosen, Priority.HIGH, now_s)
        return None

    def _write(self, chosen: Chosen, reason: str, now_s: float, readings: Snapshot | None) -> None:
        parts, strategy, actions = self._parts, chosen.strategy, chosen.actions
        if not parts.tenure.held:
            objection = parts.tenure.take(now_s)
            if objection:
                parts.alarms.raise_("lease", objection, Priority.HIGH, now_s)
        if parts.writer.flying is not None:
            parts.writer.overtake(now_s, "a fallback acts")
        self._acting, self._loaded, self.standing, self._held = chosen, False, False, False
        self.strategy = strategy
        write = Write.of(Cause.FALLBACK, strategy.name, actions)
        parts.writer.begin(write, now_s)
        if parts.writer.broken and not parts.tenure.take(now_s):  # a lease that was lost without a word costs no tick
            parts.writer.repeat(now_s)
        parts.note(FellBack(strategy.name, actions.commands, reason), now_s)
        if parts.writer.accepted:
            self._load(chosen, now_s)

    def _load(self, acting: Chosen, now_s: float) -> None:
        self._loaded = True
        self._parts.sequencer.load(acting.actions, now_s, aborting=True)
        self._parts.note(loaded(acting.strategy.name, acting.actions, aborting=True), now_s)

    def _stands(self, acting: Chosen, now_s: float) -> None:
        self.standing = True
        self._parts.note(FallbackStands(acting.strategy.name), now_s)
        for name in (f"fallback:{acting.strategy.name}", "shed"):
            self._parts.alarms.return_(name, now_s)
        self._acting = None

    def _disobeyed(self, now_s: float, readings: Snapshot | None) -> None:
        """The plant does not hold what was sent; where a late write was not put right, everything is sent again."""
        reason = self._parts.writer.error or "the plant does not hold every target after every attempt"
        acting, self._acting = self._acting, None
        if acting is None:
            self.fallbacks.begin()
        else:
            self._failed(acting, reason, now_s)
        self._act(now_s, readings)

    def _failed(self, acting: Chosen, reason: str, now_s: float) -> None:
        name = acting.strategy.name
        self._parts.note(FallbackSkipped(name, reason), now_s)
        self._parts.alarms.raise_(f"fallback:{name}", f"not obeyed: {reason}", Priority.CRITICAL, now_s)

    def _shed(self, now_s: float) -> None:
        """Stop the heartbeat; strategies are tried again after a while, because the plant may obey again."""
        parts = self._parts
        self._acting, self._again_s = None, now_s + parts.settings.again_s
        reason = "no fallback passes its checks, is obeyed and helps"
        if not parts.alarms.lasts("shed"):
            parts.note(Shed(reason), now_s)
        parts.alarms.raise_("shed", f"{reason}; the plant's own control goes on", Priority.CRITICAL, now_s)
        parts.tenure.give_back(now_s)


def loaded(source: str, actions: ActionSet, aborting: bool) -> SequenceLoaded:
    """The event of a sequencer that goes on with ``actions``."""
    steps = tuple(StepLoaded(s.transition.name, s.commands) for s in actions.then)
    return SequenceLoaded(source, actions.target, steps, aborting)
