"""Restart: the guard stands where its journal ends, and reads what was carried out before it writes anything."""

from __future__ import annotations

from homeostat.domain.alarm import Priority
from homeostat.domain.guard_events import Cause, FallbackStands, ReadBack, StepTaken
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.latch import Latch, loaded
from homeostat.guard.memory import PUT_RIGHT, Memory, OpenWrite
from homeostat.guard.parts import Parts
from homeostat.guard.writer import holds


class Restart:
    """Brings the parts of a guard to where a memory says that they stood; resolves open writes by reading."""

    def __init__(self, parts: Parts, latch: Latch, memory: Memory) -> None:
        """The position is taken over at once, what was in flight once the plant was read."""
        self._parts, self._latch, self._memory = parts, latch, memory
        self._stands = False
        parts.writer.numbered = memory.writes
        parts.service.restore(memory.out)
        if memory.state:
            parts.sequencer.restore(memory.state, self._waiting(), memory.aborting)
        if memory.latched is not None:
            latch.hold(memory.latched)

    def resolve(self, now_s: float, readings: Snapshot) -> None:
        """Say what became of every open write, and have an unconfirmed fallback sent until it stands."""
        for number, write in sorted(self._memory.open.items()):
            deviating = tuple(c.tag for c in write.commands if not self._held(c, readings))
            confirmed = tuple(c.tag for c in write.commands if c.tag not in deviating)
            self._parts.note(ReadBack(number, confirmed, deviating), now_s)
            if not deviating:
                self._carried_out(write, now_s)
            elif confirmed and write.cause is not Cause.FALLBACK:
                text = f"write {number} ({write.source}) was carried out in part: not {', '.join(deviating)}"
                self._parts.alarms.raise_("write:half", text, Priority.HIGH, now_s)
        if self._memory.latched is not None:
            self._latch.restore("" if self._stands else self._memory.strategy, now_s, readings)

    def _carried_out(self, write: OpenWrite, now_s: float) -> None:
        """The plant holds what was intended: go on behind it, and send it no more."""
        sequencer = self._parts.sequencer
        if write.cause is Cause.SEQUENCE and sequencer.waiting:
            step = sequencer.waiting[0]
            if step.transition.name == write.source:
                sequencer.take(step, now_s)
                self._parts.note(StepTaken(step.transition.name, step.target), now_s)
            return
        fallback = write.cause is Cause.FALLBACK
        if fallback and write.source == self._memory.strategy:
            self._stands = True
            self._parts.note(FallbackStands(write.source), now_s)
        if write.cause is not Cause.SEQUENCE and write.source != PUT_RIGHT and sequencer.state != write.state:
            actions = ActionSet(write.commands, write.state, self._steps(write.steps))
            sequencer.load(actions, now_s, aborting=fallback)
            self._parts.note(loaded(write.source, actions, aborting=fallback), now_s)

    def _held(self, command: Command, readings: Snapshot) -> bool:
        rule = self._parts.rules.writables.get(command.tag)
        return holds(command, readings, 0.0 if rule is None else rule.tolerance)

    def _waiting(self) -> tuple[Step, ...]:
        """The steps that are left: those that were loaded, or the rest of the nominal sequence."""
        if self._memory.waiting is not None:
            return self._steps(self._memory.waiting)
        nominal = tuple(self._parts.rules.nominal)
        while nominal and nominal[0].transition.source != self._memory.state:
            nominal = nominal[1:]
        return nominal

    def _steps(self, named: tuple[tuple[str, tuple[Command, ...]], ...]) -> tuple[Step, ...]:
        by_name = {t.name: t for t in self._parts.rules.machine.transitions}
        return tuple(Step(by_name[name], commands) for name, commands in named if name in by_name)
