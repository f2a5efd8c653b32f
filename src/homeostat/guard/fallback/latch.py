"""The latch: a fallback that was activated acts until it stands; nothing else is released before a person's reset."""

import math

from homeostat.domain.alarm import Priority
from homeostat.domain.events.trips import FallbackActivated, FallbackSkipped, FallbackStands, Latched, Shed
from homeostat.domain.events.writes import Cause
from homeostat.domain.recovery import Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.fallback import Chosen, Fallbacks
from homeostat.guard.fallback.trial import Trial
from homeostat.guard.parts import Parts
from homeostat.guard.sequence.sequencer import loaded
from homeostat.guard.writing.flight import Failed, Progress, Write

UNREAD = "unseen"
"""Identifier of the alarm that nothing says whether the plant holds what a fallback has sent."""


class Latch:
    """Activates fallbacks: the armed one, then the next, then the plant's own shed.

    ``violated``, wherever it is asked for, are the hard limits that are violated at present.
    """

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
        self._again_s = -math.inf
        self._tried = frozenset[str]()

    @property
    def forced(self) -> frozenset[str]:
        """Tags that the fallback writes even where they are out of service."""
        return frozenset() if self.strategy is None else self.strategy.forced

    def rate(self, tag: str) -> float | None:
        """How fast ``tag`` is brought back to where it was, in its unit per second: as the fallback moves it."""
        commands = () if self.strategy is None else self.strategy.actions.commands
        own = (c.rate for c in commands if c.tag == tag and c.value is not None)
        return next(own, self._parts.rules.tags[tag].rate_limit)

    @property
    def shed(self) -> bool:
        """Whether a fallback is wanted and nobody holds the lease: the plant is left to its own control."""
        return self.reason is not None and not self.standing and not self._parts.tenure.held

    def activate(self, reason: str, now_s: float, readings: Snapshot | None, violated: frozenset[str]) -> None:
        """Latch and act now, whatever is under way: by the armed strategy, or one that serves what is violated."""
        if self.reason is not None:
            return
        self.reason = reason
        self._parts.alarms.raise_("latched", reason, Priority.CRITICAL, now_s)
        self.fallbacks.begin(self.fallbacks.armed)
        self._act(now_s, readings, violated)
        self._parts.note(Latched(reason), now_s)

    def escalate(
        self, limits: frozenset[str], reason: str, now_s: float, readings: Snapshot | None, violated: frozenset[str]
    ) -> bool:
        """``limits`` are violated although a fallback stands: the next strategy that passes its checks acts.

        False where there is none; what stands is better than what the plant does by itself.
        """
        chosen = self._next(now_s, readings, violated, limits)
        if chosen is None:
            return False
        self._write(chosen, reason, now_s, limits)
        return True

    def give_way(
        self, tag: str, now_s: float, readings: Snapshot | None, violated: frozenset[str], unseen: frozenset[str]
    ) -> None:
        """Somebody has moved ``tag``, to which a fallback is being sent: it is theirs, unless the row says otherwise.

        What else the strategy writes is still sent. Where a hard limit is seen to be violated all the same, or nothing
        is left to send, the strategy has failed, and the next one that passes its checks acts, best one that brings the
        limit back. Where there is none, what is left of this one is better than what the plant does by itself. Of the
        ``unseen`` limits nobody knows, so that they call for no other strategy.
        """
        writer, acting = self._parts.writer, self._acting
        flying = writer.flying
        if flying is None or flying.cause is not Cause.FALLBACK or tag in self.forced:
            return
        if tag not in {c.tag for c in flying.commands}:
            return
        left, reason = writer.without(tag), f"somebody has moved {tag!r} meanwhile"
        fails = acting is not None and bool(violated - unseen or not left)
        following = self._next(now_s, readings, violated) if fails else None
        if left and following is None:
            return
        writer.overtake(now_s, reason)
        if acting is not None:
            self._failed(acting, reason, now_s)
        if following is not None:
            self._write(following, self.reason or "", now_s)
        elif acting is not None:
            self._shed(now_s)

    def again(self, now_s: float) -> None:
        """Send everything once more: what was being sent has left something out, or given way, for no reason."""
        if self.reason is not None and not self.standing:
            self._parts.writer.overtake(now_s, "the fallback begins again")
            self.fallbacks.begin()
            self._acting, self._again_s = None, -math.inf

    def give_up(
        self, limits: frozenset[str], reason: str, now_s: float, readings: Snapshot | None, violated: frozenset[str]
    ) -> None:
        """What stands does not help and is spent until a reset. The next strategy acts; after the last, the shed.

        Where :meth:`keeps` names any, what stands is kept instead.
        """
        if self.strategy is not None:
            self.fallbacks.spend(self.strategy.name)
        if not self.escalate(limits, reason, now_s, readings, violated):
            self._shed(now_s)

    def keeps(self, limits: frozenset[str], readings: Snapshot | None, violated: frozenset[str]) -> tuple[str, ...]:
        """Names of the strategies for whose sake what stands is not given up, although it does not help ``limits``.

        They serve none of these, and may take back what was sent for a limit that is violated. Empty where another one
        may act, or none is left at all.
        """
        fallbacks, service = self.fallbacks, self._parts.service
        left = fallbacks.left(limits, violated)
        ready = any(isinstance(fallbacks.checked(s, readings, service.tags), Chosen) for s in left)
        return () if ready else fallbacks.withheld(limits, violated)

    def hold(self, reason: str, strategy: str, spent: frozenset[str], trial: Trial) -> None:
        """Be latched again after a restart, before the plant was read; ``strategy`` had acted last.

        ``spent`` are the strategies that do not help, ``trial`` says who had a turn.
        """
        self.reason, self._tried = reason, trial.tried
        self.strategy = next((s for s in self._parts.rules.fallbacks if s.name == strategy), None)
        self.fallbacks.sent = spent | trial.tried | {strategy}
        for name in spent:
            self.fallbacks.spend(name)
        self.standing = self._held = True

    def restore(self, strategy: str, now_s: float, readings: Snapshot | None, violated: frozenset[str]) -> None:
        """Go on after a restart: ``strategy`` is sent again; empty where what acted last is known to stand.

        Where nothing that the tables know has acted, because nothing passed its checks, nothing stands either.
        """
        self._parts.alarms.raise_("latched", self.reason or "", Priority.CRITICAL, now_s)
        if not self._held:
            return  # another limit was violated before the plant was read, and a fallback is being sent
        acted = self.strategy.name if self.strategy is not None else ""
        self._held, self.standing = False, bool(acted) and not strategy and acted not in self.fallbacks.spent
        self.fallbacks.begin(strategy or acted, self._tried)
        if self.standing:
            self.fallbacks.take()  # what stands is not the next one
        else:
            self._act(now_s, readings, violated)

    def reset(self, now_s: float) -> None:
        """Forget what was activated, and the alarms of it."""
        parts = self._parts
        self.reason, self.strategy, self._acting, self._again_s = None, None, None, -math.inf
        self._loaded = self.standing = False
        self.fallbacks = Fallbacks(parts.rules)
        parts.jumps.forget()  # a person has looked at the plant
        parts.writer.overtake(now_s, "the latch was reset")
        parts.writer.forget()
        for name in ("latched", "shed", "fallbacks", UNREAD, *(f"fallback:{s.name}" for s in parts.rules.fallbacks)):
            parts.alarms.return_(name, now_s)

    def allowed(self, commands: tuple[Command, ...]) -> tuple[Command, ...]:
        """Those of ``commands`` that a fallback's step may write: no tag that a person has, unless its row says so."""
        if self.reason is None:
            return commands
        return tuple(c for c in commands if c.tag in self._parts.service.tags or c.tag in self.forced)

    def follow(
        self,
        write: Write | None,
        progress: Progress | Failed | None,
        now_s: float,
        readings: Snapshot | None,
        violated: frozenset[str],
    ) -> None:
        """Take note of how far ``write`` has come, and begin the next strategy where a fallback has failed."""
        if self.reason is None:
            return
        parts, ours = self._parts, write is not None and write.cause is Cause.FALLBACK
        acting = self._acting if ours else None
        if acting is not None and not self._loaded and (parts.writer.accepted or progress is Progress.CONFIRMED):
            self._load(acting, now_s)
        if acting is not None and progress is Progress.CONFIRMED:
            self._stands(acting, now_s)
        elif ours and isinstance(progress, Failed) and progress.unread and acting is not None:
            self._unread(acting, progress.reason, now_s)
        elif ours and isinstance(progress, Failed):
            self._disobeyed(progress, now_s, readings, violated)
        elif ours and parts.writer.broken:
            parts.tenure.take(now_s)  # perhaps the lease was lost; the next attempt has a new one
        elif self._due(now_s):
            self._act(now_s, readings, violated)

    def _due(self, now_s: float) -> bool:
        """Whether it is time to act: nothing stands, nothing is being sent, and the last vain round is over."""
        over = now_s >= self._again_s or self._parts.tenure.arrived  # with a lease that comes late it acts at once
        return not self.standing and self._parts.writer.flying is None and over

    def _act(self, now_s: float, readings: Snapshot | None, violated: frozenset[str]) -> None:
        """Write the next strategy that passes its checks; none stops a trip, so the plant's own shed is the last."""
        chosen = self._next(now_s, readings, violated)
        if chosen is None:
            self._shed(now_s)
        else:
            self._write(chosen, self.reason or "", now_s)

    def _next(
        self, now_s: float, readings: Snapshot | None, violated: frozenset[str], limits: frozenset[str] = frozenset()
    ) -> Chosen | None:
        """The next strategy that passes its checks; None where none does.

        Best one that brings ``limits`` back, then one that brings back whatever else is violated, then any.
        """
        parts = self._parts
        while (strategy := self.fallbacks.take(limits, violated)) is not None:
            chosen = self.fallbacks.checked(strategy, readings, parts.service.tags)
            if isinstance(chosen, Chosen):
                return chosen
            parts.note(FallbackSkipped(strategy.name, chosen), now_s)
            parts.alarms.raise_(f"fallback:{strategy.name}", chosen, Priority.HIGH, now_s)
        return None

    def _stop(self, now_s: float, reason: str) -> None:
        """Nothing that was asked or was to follow before goes on, be it a fallback's."""
        self._parts.writer.overtake(now_s, reason)
        self._parts.sequencer.stop()

    def _write(self, chosen: Chosen, reason: str, now_s: float, answers: frozenset[str] = frozenset()) -> None:
        parts, strategy, actions = self._parts, chosen.strategy, chosen.actions
        self._stop(now_s, "a fallback acts")
        if not parts.tenure.held:
            objection = parts.tenure.take(now_s)
            if objection:
                parts.alarms.raise_("lease", objection, Priority.HIGH, now_s)
        self._acting, self._loaded, self.standing, self._held = chosen, False, False, False
        self.strategy = strategy
        self.fallbacks.sent |= {strategy.name}
        write = Write.of(Cause.FALLBACK, strategy.name, actions)
        parts.writer.begin(write, now_s)
        if parts.writer.broken and not parts.tenure.take(now_s):  # a lease that was lost without a word costs no tick
            parts.writer.repeat(now_s)
        parts.note(FallbackActivated(strategy.name, actions.commands, reason, tuple(sorted(answers))), now_s)
        if parts.writer.accepted:
            self._load(chosen, now_s)

    def _load(self, acting: Chosen, now_s: float) -> None:
        self._loaded = True
        self._parts.sequencer.load(acting.actions, now_s, aborting=True)
        self._parts.note(loaded(acting.strategy.name, acting.actions, aborting=True), now_s)

    def _stands(self, acting: Chosen, now_s: float) -> None:
        self.standing = True
        self._parts.note(FallbackStands(acting.strategy.name), now_s)
        for name in (f"fallback:{acting.strategy.name}", "shed", UNREAD):
            self._parts.alarms.return_(name, now_s)
        self._acting = None

    def _disobeyed(self, failed: Failed, now_s: float, readings: Snapshot | None, violated: frozenset[str]) -> None:
        """The plant does not hold what was sent; where a late write was not put right, everything is sent again.

        Of what it has refused as a whole there is nothing that the next strategy could take back.
        """
        acting, self._acting = self._acting, None
        if acting is None:
            self.fallbacks.begin("" if self.strategy is None else self.strategy.name)
        else:
            if failed.read is not None and not failed.read.written:
                self.fallbacks.sent -= {acting.strategy.name}
            self._failed(acting, failed.reason, now_s)
        self._act(now_s, readings, violated)

    def _unread(self, acting: Chosen, reason: str, now_s: float) -> None:
        """Nothing says what the plant holds, which is no evidence that it does not obey: the same is sent again."""
        name, after_s = acting.strategy.name, self._parts.settings.again_s
        self._acting, self._again_s = None, now_s + after_s
        self.fallbacks.repeat(name)
        text = f"whether the plant holds {name!r} cannot be read, a person must look"
        text = f"{text}; it is sent again after {after_s:g} s, and no other fallback is tried for that: {reason}"
        self._parts.alarms.raise_(UNREAD, text, Priority.CRITICAL, now_s)

    def _failed(self, acting: Chosen, reason: str, now_s: float) -> None:
        name = acting.strategy.name
        self._parts.note(FallbackSkipped(name, reason), now_s)
        self._parts.alarms.return_(UNREAD, now_s)
        self._parts.alarms.raise_(f"fallback:{name}", f"not obeyed: {reason}", Priority.CRITICAL, now_s)

    def _shed(self, now_s: float) -> None:
        """Stop the heartbeat; strategies are tried again after a while, because the plant may obey again."""
        parts = self._parts
        self._acting, self.standing, self._again_s = None, False, now_s + parts.settings.again_s
        self.fallbacks.begin()
        self._stop(now_s, "the plant's own control goes on")
        reason = "no fallback passes its checks, is obeyed and helps"
        if not parts.alarms.lasts("shed"):
            parts.note(Shed(reason), now_s)
        parts.alarms.raise_("shed", f"{reason}; the plant's own control goes on", Priority.CRITICAL, now_s)
        parts.tenure.give_back(now_s)
