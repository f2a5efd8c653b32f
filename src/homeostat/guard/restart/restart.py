"""Restart: the guard stands where its journal ends, and reads what was carried out before it writes anything."""

import math

from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import StepTaken
from homeostat.domain.events.trips import FallbackStands
from homeostat.domain.events.writes import Cause, ReadBack
from homeostat.domain.mode import Side
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.parts import Parts
from homeostat.guard.restart.memory import Memory, OpenWrite
from homeostat.guard.sequence.sequencer import loaded
from homeostat.guard.sequence.steps import Steps
from homeostat.guard.watch.start_up import StartUpPhase
from homeostat.guard.writing.flight import PUT_RIGHT, Write, between, holds


class Restart:
    """Brings the parts of a guard to where a memory says that they stood; resolves open writes by reading."""

    def __init__(self, parts: Parts, latch: Latch, steps: Steps, memory: Memory) -> None:
        """The position is taken over at once, what was in flight once the plant was read."""
        self._parts, self._latch, self._steps, self._memory = parts, latch, steps, memory
        self._strategy = memory.strategy
        self._latched = memory.latched is not None
        self._overtaken = False
        latch.fallbacks.rank(memory.trial.ranked)
        if not memory.trial.named:
            latch.fallbacks.armed = ""
        self.released = False
        """Whether a request was being written when the guard died, and the plant holds it."""
        if memory.latched is not None:
            latch.hold(memory.latched, memory.acted, memory.spent, memory.trial)
        parts.writer.numbered = memory.writes
        parts.service.restore(memory.out)
        parts.service.restore_targets(memory.targets)

    def take_position(self, now_s: float, start_up: StartUpPhase) -> None:
        """Take over where the sequence stood; nothing waits where the machine does not know it any more.

        A start-up that the journal does not say to have begun, because the guard died at that moment, begins now.
        """
        memory, sequencer, rules = self._memory, self._parts.sequencer, self._parts.rules
        initial = rules.machine.initial.name
        start_up.restore(
            memory.starting_s, memory.started, (memory.state if memory.left is None else memory.left) or initial
        )
        if memory.left is not None:
            start_up.enter(memory.state, now_s)
        state = memory.state or initial
        try:
            sequencer.restore(state, self._waiting(state), memory.aborting, memory.released)
        except ValueError as unknown:
            sequencer.stop()
            text = f"the sequence cannot go on where the journal says that it stood: {unknown}"
            self._parts.alarms.raise_("sequence", text, Priority.HIGH, now_s)

    def explain(self, readings: Snapshot) -> None:
        """What an open write may have brought about is nobody else's doing, be it half of a ramp of the guard."""
        parts = self._parts
        for command in (c for write in self._memory.open.values() for c in write.commands):
            rule, before = parts.rules.writables.get(command.tag), parts.service.target(command.tag)
            target = readings.accepted.get(command.tag, math.nan)
            ramped = rule is not None and rule.ramped_by is Side.GUARD
            on_ramp = ramped and between(target, before, command.value, self._tolerance(command.tag))
            if on_ramp or holds(command, readings, self._tolerance(command.tag)):
                parts.service.adopt((command,), readings)

    def act(self, now_s: float, violated: frozenset[str]) -> None:
        """The plant says nothing: a fallback that is not known to stand is sent all the same."""
        self._restore(now_s, None, violated)

    def resolve(self, now_s: float, readings: Snapshot, violated: frozenset[str]) -> None:
        """Say what became of every open write, and have an unconfirmed fallback sent until it stands.

        ``violated``: hard limits that are, against which what is sent is chosen.
        """
        if self._latch.reason is not None and self._memory.latched is None:
            self._overtaken = True  # a limit was violated before the plant was read: what was open is void
        if self._memory.untold:
            self._parts.note(FallbackStands(self._memory.untold), now_s)
        for number, write in sorted(self._memory.open.items()):
            deviating = tuple(c.tag for c in write.commands if not holds(c, readings, self._tolerance(c.tag)))
            confirmed = tuple(c.tag for c in write.commands if c.tag not in deviating)
            self._parts.note(ReadBack(number, confirmed, deviating), now_s)
            if not deviating:
                self._carried_out(number, write, now_s)
            else:
                self._missed(number, write, confirmed, deviating, now_s)
        if self._memory.owed is not None and self._owes(self._memory.owed):
            self._owe(self._memory.owed)
        self._restore(now_s, readings, violated)

    def _restore(self, now_s: float, readings: Snapshot | None, violated: frozenset[str]) -> None:
        if self._latched:
            self._latched = False
            self._latch.restore(self._strategy, now_s, readings, violated)

    def _carried_out(self, number: int, write: OpenWrite, now_s: float) -> None:
        """The plant holds what was intended: go on behind it, and send it no more."""
        fallback = write.cause is Cause.FALLBACK
        if fallback and write.source == self._strategy:
            self._strategy = ""
            self._parts.note(FallbackStands(write.source), now_s)
        overtaken = self._overtaken or write.given_up or number != self._memory.writes
        if overtaken or write.source == PUT_RIGHT:
            return
        self.released = write.cause is Cause.REQUEST
        if write.taken:
            return
        sequencer = self._parts.sequencer
        if write.cause is Cause.SEQUENCE:
            if sequencer.waiting and sequencer.waiting[0].transition.name == write.source:
                step = sequencer.waiting[0]
                sequencer.take(step, now_s)
                self._parts.note(StepTaken(step.transition.name, step.target), now_s)
            return
        actions = ActionSet(write.commands, write.state, self._steps_of(write.steps))
        sequencer.load(actions, now_s, aborting=fallback)
        self._parts.note(loaded(write.source, actions, aborting=fallback), now_s)

    def _missed(
        self, number: int, write: OpenWrite, confirmed: tuple[str, ...], deviating: tuple[str, ...], now_s: float
    ) -> None:
        """The plant does not hold all of it: a fallback is sent again, a step that counts as taken as well."""
        if write.source == PUT_RIGHT:
            self._strategy = self._memory.acted
        elif write.cause is Cause.SEQUENCE and write.taken and self._owes(write):
            self._owe(write)
        elif write.cause is not Cause.FALLBACK and (confirmed or write.taken):
            behind = write.cause in (Cause.REQUEST, Cause.PERSON) and write.taken
            if behind and number == self._memory.writes:
                self._parts.sequencer.stop()  # nothing follows behind what the plant does not hold
            text = f"write {number} ({write.source}) was carried out in part: not {', '.join(deviating)}"
            self._parts.alarms.say("write:half", text, Priority.HIGH, now_s)

    def _owes(self, write: OpenWrite) -> bool:
        """Whether a step that counts as taken is still wanted: nothing came between, and its fallback, if any, stands.

        Where a fallback is sent again, its later steps follow it once more by themselves.
        """
        same_life = write.latched == (self._memory.latched is not None)
        return same_life and not (write.given_up or self._overtaken or self._strategy)

    def _owe(self, write: OpenWrite) -> None:
        self._steps.owe(Write(Cause.SEQUENCE, write.source, write.commands, write.state))

    def _tolerance(self, tag: str) -> float:
        rule = self._parts.rules.writables.get(tag)
        return 0.0 if rule is None else rule.tolerance

    def _waiting(self, state: str) -> tuple[Step, ...]:
        """The steps that are left: those that were loaded, or the rest of the nominal sequence."""
        if self._memory.waiting is not None:
            return self._steps_of(self._memory.waiting)
        nominal = tuple(self._parts.rules.nominal)
        while nominal and nominal[0].transition.source != state:
            nominal = nominal[1:]
        return nominal

    def _steps_of(self, named: tuple[tuple[str, tuple[Command, ...]], ...]) -> tuple[Step, ...]:
        """Steps by the transitions of the tables; ValueError where those have no such path any more."""
        by_name = {t.name: t for t in self._parts.rules.machine.transitions}
        unknown = [name for name, _ in named if name not in by_name]
        if unknown:
            raise ValueError(f"there is no transition {unknown[0]!r}")
        steps = tuple(Step(by_name[name], commands) for name, commands in named)
        if steps:
            RecoveryPath(self._parts.rules.machine, tuple(s.transition for s in steps))
        return steps
