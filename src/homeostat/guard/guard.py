"""The guard: one synchronous decision per tick; trip before request before sequence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from homeostat.domain.alarm import Alarm, Priority
from homeostat.domain.guard_events import (
    Armed,
    Cause,
    GuardStarted,
    ModeEntered,
    StartUpEnded,
    StateEntered,
    StepTaken,
    Stopped,
    Tripped,
)
from homeostat.domain.mode import Mode, PersonCommand, Side
from homeostat.domain.observation import Arm, Correction, FallBack, Message, Observation, Trouble, Withdraw
from homeostat.domain.ports import Lease, Record
from homeostat.domain.recovery import Command, Step
from homeostat.domain.request import Request
from homeostat.domain.rules import GuardRules
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.latch import Latch
from homeostat.guard.mailbox import Mailbox
from homeostat.guard.memory import PUT_RIGHT, Memory
from homeostat.guard.modes import Modes
from homeostat.guard.parts import Parts
from homeostat.guard.persons import Floor, Persons
from homeostat.guard.quality import QualityWatch
from homeostat.guard.requests import Requests
from homeostat.guard.restart import Restart
from homeostat.guard.settings import GuardSettings
from homeostat.guard.trips import TripWatch, Violation
from homeostat.guard.verification import Present
from homeostat.guard.writer import Progress, Write


@dataclass(frozen=True, slots=True)
class Attachment:
    """What a guard is attached to, and in which mode it begins."""

    record: Record
    """Where its events go."""
    lease: Lease | None = None
    """The right to write; None where the plant is only observed."""
    mode: Mode = Mode.CLOSED_LOOP
    """Mode in which it begins."""
    keys: Mapping[str, bytes] = field(default_factory=dict)
    """Issuer -> the key of its seals."""
    memory: Memory | None = None
    """What a journal says of the guard before; None for a plant that nobody has watched yet."""
    goes_on: bool = True
    """Whether a restart goes on in the journalled mode, as in simulation; a real plant stands in observe first."""


class Guard:
    """Decides once per tick of its own clock, with a sample or with its absence; nothing that it calls can end it."""

    def __init__(self, rules: GuardRules, attachment: Attachment, settings: GuardSettings | None = None) -> None:
        """``rules`` come from the plant's tables; nothing is decided before the first :meth:`tick`."""
        self._parts = Parts.of(rules, attachment.record, attachment.lease, settings or GuardSettings())
        self._attachment = attachment
        self._quality = QualityWatch(rules.qualities, rules.tags, self._parts.note)
        self._trips = TripWatch(rules, self._parts.note)
        self._latch, self._modes = Latch(self._parts), Modes(self._parts)
        self._requests = Requests(self._parts, dict(attachment.keys))
        self._persons = Persons(Floor(self._parts, self._modes, self._latch, self._requests))
        self._step: Step | None = None
        self._step_again_s = -math.inf
        self._act_by_s: float | None = None
        self._violated: frozenset[str] = frozenset()
        self._now_s = -math.inf
        self._seen: Snapshot | None = None
        self._sample: Snapshot | None = None
        self._began = False
        self._starting = rules.machine.initial.name in rules.start_up.states
        self._restart: Restart | None = None
        self.mailbox = Mailbox()
        """Where anybody leaves requests and orders."""

    @property
    def mode(self) -> Mode:
        """Mode of the plant."""
        return self._modes.mode

    @property
    def latched(self) -> str | None:
        """Why a fallback acted; None while none has."""
        return self._latch.reason

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Standing alarms, the oldest first."""
        return self._parts.alarms.standing

    @property
    def offered(self) -> tuple[Request, ...]:
        """Requests that wait for a person."""
        return self._requests.offered

    @property
    def out_of_service(self) -> frozenset[str]:
        """Writable tags that the guard may not write."""
        return self._parts.service.out

    def tick(self, now_s: float, sample: Snapshot | None) -> Observation:
        """Decide at process time ``now_s`` [s] with ``sample``, or with its absence; never raises, never waits long."""
        if not (math.isfinite(now_s) and now_s > self._now_s):
            text = f"the clock says {now_s!r} s after {self._now_s:g} s"
            self._alarm("clock", text, Priority.HIGH)
            now_s = self._now_s if math.isfinite(self._now_s) else 0.0
        self._now_s = now_s
        for stage in (self._begin, self._look, self._write_on, self._hear, self._decide, self._end):
            try:
                stage(sample)
            except Exception as error:  # a broken rule or link must not end supervision
                name = stage.__name__.strip("_")
                self._alarm(f"guard:{name}", f"{name}: {error or type(error).__name__}", Priority.CRITICAL)
        return self._observed()

    def stop(self, reason: str) -> None:
        """A wanted stop: no fallback is written; the heartbeat ends, and the plant's own control carries on."""
        self._parts.writer.overtake(self._now_s, reason)
        self._requests.withdraw_all(reason, self._now_s)
        self._parts.note(Stopped(reason), self._now_s)
        self._modes.leave(self._now_s)
        self._parts.recorder.commit()
        self._parts.recorder.close()

    def _begin(self, sample: Snapshot | None) -> None:
        if self._began:
            return
        self._began = True
        parts, memory, mode = self._parts, self._attachment.memory, self._attachment.mode
        if memory is not None:
            mode = (memory.mode or mode) if self._attachment.goes_on else Mode.OBSERVE
            self._restart = Restart(parts, self._latch, memory)
        objection = self._modes.enter(mode, self._now_s)
        if objection:
            self._alarm("mode", objection, Priority.HIGH)
        rules = parts.rules
        parts.note(
            GuardStarted(rules.plant, rules.configuration, self.mode.value, rules.recipe.value, memory is not None),
            self._now_s,
        )
        parts.note(ModeEntered(self.mode.value, ""), self._now_s)

    def _look(self, sample: Snapshot | None) -> None:
        """What the plant says, and how far it can be trusted."""
        self._seen = self._quality.assess(self._now_s, sample)
        self._sample = None if self._quality.trouble else sample
        if self._quality.trouble:
            self._alarm("link", self._quality.trouble, Priority.HIGH)
        else:
            self._parts.alarms.return_("link", self._now_s)

    def _write_on(self, sample: Snapshot | None) -> None:
        """How far the write under way has come, and what somebody else has moved."""
        parts, now_s, readings = self._parts, self._now_s, self._seen
        if self._restart is not None and readings is not None:
            restart, self._restart = self._restart, None
            restart.resolve(now_s, readings)
        write = parts.writer.flying
        progress = parts.writer.follow(now_s, readings)
        if progress is Progress.FAILED and write is not None:
            parts.service.adopt(write.commands, readings)
            text = f"{write.source}: {parts.writer.error or 'the plant does not hold every target'}"
            self._alarm(f"write:{write.cause.value}", text, Priority.HIGH)
        elif progress is Progress.CONFIRMED and write is not None:
            parts.service.expect(write.commands)
            parts.alarms.return_(f"write:{write.cause.value}", now_s)
        self._requests.follow(progress if write and write.cause is Cause.REQUEST else None, now_s)
        self._latch.follow(progress if write and write.cause is Cause.FALLBACK else None, now_s, readings)
        if write is not None and write.cause is Cause.SEQUENCE:
            self._follow_step(progress)
        if readings is not None:
            self._moved(readings)
        parts.writer.read_given_up(now_s, readings)

    def _moved(self, readings: Snapshot) -> None:
        """A target that somebody else has changed is respected; a write of ours that came late is put right."""
        parts = self._parts
        for moved in parts.service.moved(readings, parts.writer.pending):
            late = parts.writer.late(moved.tag, moved.now)
            if late and self.latched is not None and parts.writer.flying is None:
                command = Command(moved.tag, moved.before, parts.rules.tags[moved.tag].rate_limit)
                self._alarm("late", f"a write that was given up has moved {moved.tag!r} after all", Priority.HIGH)
                parts.writer.begin(Write(Cause.FALLBACK, PUT_RIGHT, (command,), parts.sequencer.state), self._now_s)
                continue
            if parts.rules.recipe is Side.PLANT and not self.mode.writes:
                continue
            text = f"somebody changed {moved.tag!r} from {moved.before} to {moved.now}"
            if parts.service.change(moved.tag, False, "", text, self._now_s):
                self._alarm(f"moved:{moved.tag}", text, Priority.MEDIUM)

    def _hear(self, sample: Snapshot | None) -> None:
        """Everything that was put into the mailbox since the last tick."""
        for message in self.mailbox.take():
            try:
                self._take(message)
            except Exception as error:  # a message may be anything
                self._alarm("mailbox", f"a message could not be taken: {error or type(error).__name__}", Priority.LOW)

    def _take(self, message: Message) -> None:
        now_s = self._now_s
        match message:
            case Request():
                self._requests.receive(message, now_s, self._oldest_s, self.latched)
            case Withdraw():
                self._requests.withdraw(message.request, message.reason, now_s)
            case Correction():
                self._trips.correct(message.errors)
            case Arm():
                wrong = self._latch.fallbacks.arm(message.strategies, self._seen, self._parts.service.tags)
                for line in wrong:
                    self._alarm("arming", line, Priority.MEDIUM)
                by_s = message.act_by_s
                self._act_by_s = by_s if by_s is not None and math.isfinite(by_s) else None
                self._parts.note(Armed(tuple(s.name for s in self._latch.fallbacks.ranked), self._act_by_s), now_s)
            case FallBack():
                self._activate(message.reason)
            case Trouble():
                self._alarm(message.name[:100], message.cause[:500], Priority.HIGH)
            case PersonCommand():
                self._persons.hear(message, now_s, self._seen)

    def _decide(self, sample: Snapshot | None) -> None:
        """Trip before request before sequence."""
        parts, readings, state = self._parts, self._seen, self._parts.sequencer.state
        violations = self._trips.judge(self._now_s, readings, state)
        self._note_trips(violations)
        if violations and self.latched is None:
            self._activate(violations[0].reason)
        if self._act_by_s is not None and self._now_s >= self._act_by_s and self.latched is None:
            self._act_by_s = None
            self._activate("recovery has not acted in the time that physics leaves")
        if self.latched is None:
            near = () if readings is None else self._trips.near(readings)
            present = Present(self._now_s, readings, state, parts.service.tags, near)
            if self._requests.decide(present, self.mode, self._oldest_s):
                self._act_by_s = None
                return
        self._sequence(readings)

    def _note_trips(self, violations: tuple[Violation, ...]) -> None:
        """Journal what is newly violated; while latched another limit has the next strategy act."""
        names = frozenset(v.limit for v in violations)
        for violation in violations:
            if violation.limit in self._violated:
                continue
            acts = self.mode.writes
            event = Tripped(violation.limit, violation.margin, violation.unit, violation.reason, acts)
            self._parts.note(event, self._now_s)
            self._alarm(f"trip:{violation.limit}", violation.reason, Priority.CRITICAL)
            if self.latched is not None and acts and self._latch.standing:
                self._latch.escalate(violation.reason, self._now_s, self._seen)
        for name in self._violated - names:
            self._parts.alarms.return_(f"trip:{name}", self._now_s)
        self._violated = names

    def _activate(self, reason: str) -> None:
        """Have the fallback act, where somebody may write; else it is an alarm."""
        if not self.mode.writes:
            self._alarm("fallback wanted", reason, Priority.CRITICAL)
            return
        self._step = None
        self._requests.withdraw_all(reason, self._now_s)
        self._latch.activate(reason, self._now_s, self._seen)

    def _sequence(self, readings: Snapshot | None) -> None:
        """Begin to write the step that is due, where nothing else is under way."""
        parts = self._parts
        if readings is None or self._step is not None or self._restart is not None:
            return
        step = parts.sequencer.due(readings)
        if step is None:
            return
        if not self.mode.writes:
            if parts.rules.recipe is Side.PLANT:
                self._taken(step)
            else:
                parts.sequencer.refused = f"in mode {self.mode.value!r} nobody writes"
            return
        out = [c.tag for c in step.commands if c.tag not in parts.service.tags]
        if out and self.latched is None:
            parts.sequencer.refused = f"{out[0]!r} is out of service"
            return
        if not step.commands:
            self._taken(step)
        elif parts.writer.flying is None and self._now_s >= self._step_again_s:
            self._step = step
            parts.writer.begin(Write(Cause.SEQUENCE, step.transition.name, step.commands, step.target), self._now_s)
            self._follow_step(None)

    def _follow_step(self, progress: Progress | None) -> None:
        """A step is taken when the plant has got its commands; one that failed stays due."""
        step, parts = self._step, self._parts
        if step is not None and (parts.writer.accepted or progress is Progress.CONFIRMED):
            self._taken(step)
            self._step = None
        elif step is not None and progress is Progress.FAILED:
            self._step, self._step_again_s = None, self._now_s + parts.settings.again_s

    def _taken(self, step: Step) -> None:
        self._parts.sequencer.take(step, self._now_s)
        self._parts.note(StepTaken(step.transition.name, step.target), self._now_s)

    def _end(self, sample: Snapshot | None) -> None:
        """Heartbeat and journal; the lease goes back where only a fallback was left to be sent."""
        if not self.mode.writes and (self.latched is None or self._latch.standing):
            self._modes.leave(self._now_s)
        self._modes.beat(self._now_s)
        trouble = self._parts.recorder.trouble
        if trouble:
            self._alarm("journal", trouble, Priority.HIGH)
        else:
            self._parts.alarms.return_("journal", self._now_s)

    @property
    def _oldest_s(self) -> float:
        settings = self._parts.settings
        return settings.person_s if self.mode is Mode.APPROVE else settings.check_age_s

    def _alarm(self, name: str, cause: str, priority: Priority) -> None:
        self._parts.alarms.raise_(name, cause, priority, self._now_s)

    def _observed(self) -> Observation:
        sequencer = self._parts.sequencer
        entered = sequencer.drain()
        starting = self._parts.rules.start_up.states
        for state, at_s in entered:
            self._parts.note(StateEntered(state), at_s)
            if self._starting and state not in starting:
                self._parts.note(StartUpEnded(state), at_s)
            self._starting = state in starting
        return Observation(
            self._now_s, self._seen, sequencer.state, sequencer.rest(), sequencer.way(), sequencer.refused, entered,
            self.latched, self.mode, self._requests.drain(), self._sample,
        )  # fmt: skip
