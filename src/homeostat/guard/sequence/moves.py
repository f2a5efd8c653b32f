"""Moves: what somebody else has changed is respected, and what of ours arrives too late is put right."""

from homeostat.domain.alarm import Priority
from homeostat.domain.events.writes import Cause
from homeostat.domain.mode import Mode, Side
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.parts import Parts
from homeostat.guard.sequence.arrivals import Arrivals
from homeostat.guard.sequence.service import Moved
from homeostat.guard.writing.flight import PUT_RIGHT, Failed, GivenUp, Write, same, shown
from homeostat.guard.writing.lapse import Lapse, local


class Moves:
    """Notices within one tick that a target is not the guard's any more."""

    def __init__(self, parts: Parts, latch: Latch, lapse: Lapse, arrivals: Arrivals) -> None:
        """``latch``: what arrives late is put right only while a fallback is latched; ``lapse``: what the plant did.

        ``arrivals``: what the plant's own recipe is doing.
        """
        self._parts, self._latch, self._lapse, self._arrivals = parts, latch, lapse, arrivals
        self._wrong: dict[str, Moved] = {}
        self._hands: list[tuple[Moved, float]] = []

    def notice(
        self, now_s: float, readings: Snapshot, mode: Mode, violated: frozenset[str], unseen: frozenset[str]
    ) -> None:
        """Judge every target that the plant tells, and put right what a latched fallback needs."""
        self.judge(now_s, readings, mode, violated, unseen)
        self._wrong.update(self._lapse.settle(now_s, readings))
        self._put_right(now_s)

    def judge(
        self, now_s: float, readings: Snapshot, mode: Mode, violated: frozenset[str], unseen: frozenset[str]
    ) -> None:
        """Judge every target that the plant tells: the guard's, a late one of its own, the plant's, or a person's.

        ``violated``: hard limits that are, which a fallback that gives way must answer all the same; ``unseen``: those
        of them that only cannot be judged.
        """
        parts, latched = self._parts, self._latch.reason is not None
        tenure = parts.tenure
        given_back = not tenure.held and now_s < tenure.given_back_s + parts.settings.again_s
        if latched:
            self._arrivals.clear()  # a fallback gives way to no part of a step
        self._hands.clear()
        moves = parts.service.moved(readings, self._pending)
        parts.service.expect(parts.writer.ramped(readings))
        for moved in moves:
            if self._lapse.excuses(moved) or (given_back and local(parts.rules, moved.tag, moved.now)):
                continue  # the plant's own control has taken over
            if latched and moved.tag in parts.service.tags and parts.writer.late(moved.tag, moved.now):
                self._wrong[moved.tag] = moved
                text = f"a write that was given up has moved {moved.tag!r} after all"
                parts.alarms.say(f"late:{moved.tag}", text, Priority.HIGH, now_s)
            elif not self._recipes(moved, now_s, readings, mode):
                self._take_out(moved, now_s)
                self._latch.give_way(moved.tag, now_s, readings, violated, unseen)
        for moved in self._arrivals.late(now_s):
            self._take_out(moved, now_s)

    def _recipes(self, moved: Moved, now_s: float, readings: Snapshot, mode: Mode) -> bool:
        """Whether the plant's own recipe has moved a target: with it the plant has entered a state that admits it.

        Or it belongs to a step of the recipe that is arriving.
        """
        parts, entered = self._parts, self._parts.sequencer.entered
        if mode.writes and parts.rules.recipe is Side.GUARD:
            return False
        admits = parts.evidence(readings).admits
        if entered is not None and admits(parts.rules.machine.state(entered), moved.tag, moved.now):
            return True
        return self._arrivals.takes(moved, now_s)

    def excuse(self, now_s: float) -> None:
        """The lease was lost before this tick's heartbeat: what the plant's own control moved since was no person."""
        for moved, at_s in self._hands:
            if at_s == now_s and self._lapse.excuses(moved):
                text = f"the plant's own control has moved {moved.tag!r}: the lease was lost"
                self._parts.service.change(moved.tag, True, "", text, now_s)
                self._parts.alarms.return_(f"moved:{moved.tag}", now_s)
                self._latch.again(now_s)

    def fail(self, write: Write, failed: Failed, now_s: float, readings: Snapshot | None) -> None:
        """Every attempt at ``write`` was made: what became of it is what the plant says, and an alarm."""
        parts = self._parts
        unread = parts.writer.pending
        parts.service.adopt(tuple(c for c in write.commands if c.tag not in unread), readings)
        text = f"{write.source}: {failed.error or 'the plant does not hold every target'}"
        parts.alarms.raise_(f"write:{write.cause.value}", text, Priority.HIGH, now_s)
        if failed.read is not None and failed.read.written:
            self._say_half(failed.read, now_s)

    def read(self, now_s: float, readings: Snapshot | None) -> None:
        """What became of writes that were given up, once the plant was read after them."""
        for read in self._parts.writer.read_given_up(now_s, readings):
            if read.written or read.taken:
                self._say_half(read, now_s)
            if self._latch.reason is None:
                self._parts.service.adopt(read.write.commands, readings)

    def _say_half(self, read: GivenUp, now_s: float) -> None:
        """An alarm of what was begun and has not come to its end; a fallback is sent until it stands."""
        if not read.whole and read.write.cause is not Cause.FALLBACK:
            self._parts.alarms.say("write:half", str(read), Priority.HIGH, now_s)

    def _pending(self, tag: str, before: float | None, target: float | None) -> bool:
        """Whether ``tag`` is being written and may have come from ``before`` to ``target`` by that.

        A fallback is taken to be late, clamped or not obeyed, and is sent again, where it is not clearly a person who
        has moved the tag (`Writer.by_hand`).
        """
        writer = self._parts.writer
        if tag not in writer.pending:
            return False
        if writer.expects(tag, target):
            return True
        flying = writer.flying
        return flying is not None and flying.cause is Cause.FALLBACK and not writer.by_hand(tag, before, target)

    def _take_out(self, moved: Moved, now_s: float) -> None:
        text = f"somebody changed {moved.tag!r} from {shown(moved.before)} to {shown(moved.now)}"
        self._parts.writer.leave(moved.tag)
        if self._parts.service.change(moved.tag, False, "", text, now_s):
            self._hands.append((moved, now_s))
            self._parts.alarms.raise_(f"moved:{moved.tag}", text, Priority.MEDIUM, now_s)

    def _put_right(self, now_s: float) -> None:
        """Bring back what came late or by the plant's own control, unless the tag was written or moved since."""
        parts = self._parts
        if self._latch.reason is None:
            self._wrong.clear()
        elif parts.writer.flying is None and parts.tenure.held:
            wrong, self._wrong = self._wrong, {}
            commands = tuple(
                Command(m.tag, m.before, None if m.before is None else self._latch.rate(m.tag))
                for m in wrong.values()
                if same(m.now, parts.service.target(m.tag), parts.rules.writables[m.tag].tolerance)
            )
            if commands:
                parts.writer.begin(Write(Cause.FALLBACK, PUT_RIGHT, commands, parts.sequencer.state), now_s)
