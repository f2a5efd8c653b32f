"""The guard: one synchronous decision per tick; trip before request before sequence."""

import math
from collections.abc import Callable
from typing import Any

from homeostat.domain.alarm import Alarm, Priority
from homeostat.domain.events.guard import GuardStarted, StateEntered, Stopped
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.writes import Cause, TargetsHeld
from homeostat.domain.mode import Mode, PersonCommand, Side
from homeostat.domain.observation import (
    Correction,
    FallBack,
    NoAction,
    Observation,
    Settled,
    Trouble,
    Withdraw,
)
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.request import Request
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.fallback.response import Response
from homeostat.guard.fallback.wanted import TimeToAct, Wanted
from homeostat.guard.hearing import Hearing
from homeostat.guard.mailbox import Mailbox
from homeostat.guard.pace import Pace
from homeostat.guard.parts import Attachment, Parts
from homeostat.guard.requests.persons import Floor, Persons
from homeostat.guard.requests.requests import Requests
from homeostat.guard.requests.verification import Present
from homeostat.guard.restart.restart import Restart
from homeostat.guard.sequence.arrivals import Arrivals
from homeostat.guard.sequence.moves import Moves
from homeostat.guard.sequence.steps import Steps
from homeostat.guard.settings import GuardSettings
from homeostat.guard.texts import said
from homeostat.guard.watch.alarms import Troubles
from homeostat.guard.watch.instruments import Instruments
from homeostat.guard.watch.quality import QualityWatch
from homeostat.guard.watch.trips import TripWatch
from homeostat.guard.writing.flight import Failed, Progress, Write
from homeostat.guard.writing.lapse import Lapse
from homeostat.guard.writing.tenure import Modes


class Guard:
    """Decides once per tick of its own clock, with a sample or with its absence; nothing that it calls can end it."""

    def __init__(self, rules: GuardRules, attachment: Attachment, settings: GuardSettings | None = None) -> None:
        """``rules`` come from the plant's tables; nothing is decided before the first :meth:`tick`."""
        self._parts = parts = Parts.of(rules, attachment.record, attachment.lease, settings or GuardSettings())
        self._attachment = attachment
        self._quality = QualityWatch(rules.qualities, rules.tags, parts.note, parts.jumps)
        self._instruments = Instruments(rules.qualities, parts.alarms)
        self._trips = TripWatch(rules, parts.note, parts.jumps)
        self._latch, self._modes = Latch(parts), Modes(parts.tenure)
        self._time = TimeToAct(parts.note, lambda: self._latch.fallbacks)
        self._lapse = Lapse(parts, self._latch)
        self._arrivals = Arrivals(parts)
        self._steps = Steps(parts, self._latch, self._arrivals)
        self._moves = Moves(parts, self._latch, self._lapse, self._arrivals)
        self._response = Response(parts, self._latch)
        self._requests = Requests(parts, dict(attachment.keys))
        self._persons = Persons(Floor(parts, self._modes, self._latch, self._requests, self._steps))
        self._restart: Restart | None = None
        self._wanted = Wanted(parts.alarms)
        self._troubles = Troubles(parts.alarms)
        self._pace = Pace(parts.rules.timing.tick_s)
        self._now_s, self._began_s = self._pace.now_s, math.nan
        self._seen: Snapshot | None = None
        self._sample: Snapshot | None = None
        self._violated = self._unseen = frozenset[str]()
        self._lost, self._stopped = 0, False
        self.mailbox = Mailbox()
        """Where anybody leaves requests and orders."""
        self._hearing = Hearing(self.mailbox, parts, self._latch, self._time, self._takers())

    @property
    def mode(self) -> Mode:
        """Mode of the plant."""
        return self._modes.mode

    @property
    def latched(self) -> str | None:
        """Why a fallback acted; None while none has."""
        return self._latch.reason

    @property
    def carries(self) -> bool:
        """Whether it writes something of its own beside a recipe of the plant's, which waits meanwhile."""
        writing = self._parts.writer.flying is not None
        return self.mode.writes and (writing or self._steps.owes or self._parts.sequencer.carries)

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
        self._advance(now_s)
        first = (self._begin, self._stand_back, self._look, self._hold, self._resume, self._follow, self._trip)
        stages = (*first, self._write_on, self._hear, self._decide, self._end)
        for stage in stages if not self._stopped else ():
            name = stage.__name__.strip("_")
            try:
                stage(sample)
                self._parts.alarms.return_(f"guard:{name}", self._now_s)
            except BaseException as error:  # a broken rule or link must not end supervision
                self._alarm(f"guard:{name}", f"{name}: {said(error)}", Priority.CRITICAL)
        seen = self._observed()
        self._parts.recorder.settle()
        return seen

    def stop(self, reason: str) -> None:
        """A wanted stop: no fallback is written; the heartbeat ends, and the plant's own control carries on."""
        if self._stopped:
            return
        self._stopped = True
        now_s = self._now_s if math.isfinite(self._now_s) else 0.0
        self._parts.writer.overtake(now_s, reason)
        self._requests.withdraw_all(reason, now_s)
        self._parts.note(Stopped(reason), now_s)
        self._parts.tenure.give_back(now_s)
        self._parts.recorder.commit()
        self._parts.recorder.close()

    def _advance(self, now_s: float) -> None:
        """The guard's time goes on, also where the clock does not."""
        wrong = self._pace.advance(now_s)
        self._now_s = self._pace.now_s
        self._parts.alarms.hold("clock", wrong, self._now_s)

    def _begin(self, sample: Snapshot | None) -> None:
        if not math.isnan(self._began_s):
            return
        self._began_s = self._now_s
        parts, memory, mode = self._parts, self._attachment.memory, self._attachment.mode
        if memory is not None:
            mode = (memory.mode or mode) if self._attachment.goes_on else Mode.OBSERVE
            self._restart = Restart(parts, self._latch, self._steps, memory)
            self._restart.take_position(self._now_s, self._trips.start_up)
            self._time.remember(memory.act_by_s)
            self._trips.remember(memory.trial, self._now_s)
            if memory.latched is not None:
                self._violated, self._unseen = memory.trial.violated, memory.trial.unseen
            self._response.remember(memory.trial, memory.latched is not None)
            self._requests.remember(memory.requests)
            self._persons.remember(memory.orders)
        objection = self._modes.begin(mode, self._now_s)
        if objection:
            self._alarm("mode", objection, Priority.HIGH)
        if memory is not None:
            self._lapse.restart()
        rules = parts.rules
        recipe = rules.recipe if self.mode.writes else Side.PLANT
        parts.note(
            GuardStarted(rules.plant, rules.configuration, self.mode.value, recipe.value, memory is not None),
            self._now_s,
        )
        parts.note(ModeEntered(self.mode.value, ""), self._now_s)
        if not self.mode.writes:
            self._steps.withdraw(f"the guard stands in {self.mode.value!r} after a restart", self._now_s)

    def _stand_back(self, sample: Snapshot | None) -> None:
        """What writing needs was lost: that brings the mode down before anything of this tick can be written."""
        lost = self.mailbox.stand_back()
        if lost is not None:
            self._persons.stand_back(lost.reason, self._now_s)

    def _look(self, sample: Snapshot | None) -> None:
        """What the plant says, and how far it can be trusted."""
        self._seen = self._quality.assess(self._now_s, sample)
        self._sample = None if self._quality.trouble else sample
        self._parts.alarms.hold("link", self._quality.trouble, self._now_s)
        if self._seen is not None and not self._quality.trouble:
            self._instruments.judge(self._seen, self._now_s)
        if self._seen is not None:
            self._parts.service.expect(self._parts.writer.see(self._seen))

    def _hold(self, sample: Snapshot | None) -> None:
        """Is the lease still the guard's? What was lost is taken again before anything is decided."""
        self._parts.tenure.check(self._now_s)
        late = self._modes.late(self._now_s)
        if late is not None:
            self._parts.alarms.return_("mode", self._now_s)
            self._parts.note(ModeEntered(late.value, "", "the lease has come"), self._now_s)
        self._follow_lease()

    def _follow_lease(self) -> None:
        wanted = self.mode.writes or self._sending
        if self._lapse.follow(self._now_s, wanted):
            self._moves.excuse(self._now_s)
            self._requests.fail(f"the lease was lost: {self._parts.tenure.lost}", self._now_s)

    def _resume(self, sample: Snapshot | None) -> None:
        """After a restart: what was in flight is read before anything is written; a fallback waits for no reading."""
        restart, readings = self._restart, self._seen
        if restart is None:
            return
        if readings is not None and readings.accepted:
            self._restart = None
            restart.explain(readings)
            self._moves.judge(self._now_s, readings, self.mode, self._violated, self._unseen)
            restart.resolve(self._now_s, readings, self._violated)
            if self._steps.withdrawn:
                self._steps.withdraw("nobody wrote after a restart", self._now_s)
            if restart.released:
                self._time.end(self._now_s)
        elif self._now_s - self._began_s >= self._parts.settings.again_s:
            restart.act(self._now_s, self._violated)

    def _follow(self, sample: Snapshot | None) -> None:
        """Where the plant's own recipe runs, its state is read."""
        if self._restart is None:
            self._steps.follow_plant(self._now_s, self._seen, self.mode)

    def _trip(self, sample: Snapshot | None) -> None:
        """Before anything else is written, tried again or heard: is a hard limit violated?"""
        violations = self._trips.judge(self._now_s, self._seen, self._parts.sequencer.state)
        self._parts.alarms.hold("start-up", self._trips.start_up.overdue, self._now_s)
        self._violated = frozenset(v.limit for v in violations)
        self._unseen = frozenset(v.limit for v in violations if not v.seen)
        armed = self._latch.fallbacks.armed
        self._response.take(violations, self._now_s, self._seen, self.mode.writes)
        if armed and not self._latch.fallbacks.armed:
            self._time.tell(self._now_s)
        if violations and self.latched is None:
            self._activate(violations[0].reason)
        self._wanted.follow(bool(violations), self.latched is not None, self._now_s)

    def _write_on(self, sample: Snapshot | None) -> None:
        """What somebody else has moved, and how far the write under way has come."""
        parts, now_s, readings = self._parts, self._now_s, self._seen
        if readings is not None:
            self._moves.notice(now_s, readings, self.mode, self._violated, self._unseen)
        write = parts.writer.flying
        progress = parts.writer.follow(now_s, readings, self._objection)
        if isinstance(progress, Failed) and write is not None:
            self._moves.fail(write, progress, now_s, readings)
        elif progress is Progress.CONFIRMED and write is not None:
            parts.alarms.return_(f"write:{write.cause.value}", now_s)
        self._requests.follow(progress if write and write.cause is Cause.REQUEST else None, now_s)
        self._persons.follow(write, progress, now_s)
        self._latch.follow(write, progress, now_s, readings, self._violated)
        self._steps.follow(write, progress, now_s)
        if write is not None and write.cause is Cause.REQUEST and progress is Progress.CONFIRMED:
            self._time.over()
        self._moves.read(now_s, readings)

    def _objection(self, write: Write, readings: Snapshot) -> str:
        """Why ``write`` may not be tried again on the present ``readings``; empty where it may."""
        near = self._trips.near(readings)
        if near and write.cause in (Cause.REQUEST, Cause.PERSON):
            return near[0].reason
        return self._steps.objection(write, readings)

    def _hear(self, sample: Snapshot | None) -> None:
        self._persons.expire(self._now_s)
        self._hearing.hear(self._seen, self._now_s)

    def _takers(self) -> dict[type, Callable[[Any], None]]:
        """Kind of message -> who takes it."""
        return {
            Request: lambda m: self._requests.receive(m, self._now_s, self._oldest_s, self.latched),
            Withdraw: lambda m: self._requests.withdraw(m.request, m.reason, self._now_s),
            Correction: lambda m: self._trips.correct(m.errors),
            NoAction: lambda m: self._time.end(self._now_s),
            FallBack: lambda m: self._wish(m.reason),
            Trouble: lambda m: self._troubles.begin(m, self._now_s),
            Settled: lambda m: self._troubles.end(m, self._now_s),
            PersonCommand: lambda m: self._persons.hear(m, self._present()),
        }

    def _present(self) -> Present:
        """What is asked or ordered at this moment is judged on this."""
        parts, readings = self._parts, self._seen
        near = () if readings is None else self._trips.near(readings)
        above = () if readings is None else self._trips.above(readings)
        return Present(self._now_s, readings, parts.sequencer.state, parts.service.tags, near, above, self._violated)

    def _decide(self, sample: Snapshot | None) -> None:
        """A request before the sequence; the trip was before both."""
        if self.mode.alone:
            self._wanted.drop()
        if self.latched is not None:
            self._time.over()
        unread = self._restart is not None  # what was being written when the guard died may stand
        waits = self._requests.written or (unread and self._now_s - self._began_s < self._parts.settings.again_s)
        if self._time.has_passed(self._now_s) and not waits:
            reason = "recovery has not acted in the time that physics leaves"
            if not self.mode.writes:
                self._wanted.wish(reason, None, self._now_s)
            self._activate(reason)
        if unread:
            return
        if self.latched is None and self._requests.decide(self._present(), self.mode, self._oldest_s):
            self._steps.drop()
            if not self._requests.written:
                self._time.over()
            return
        self._steps.go_on(self._now_s, self._seen, self.mode)

    def _wish(self, reason: str) -> None:
        """Recovery gives up; where a person has the say that stays an alarm until it has something better."""
        if self.mode.alone:
            self._activate(reason)
        elif self.latched is None:
            self._wanted.wish(reason, self._time.by_s, self._now_s)

    def _activate(self, reason: str) -> None:
        """Have the fallback act, where somebody may write; else it is an alarm."""
        if not self.mode.writes:
            self._time.end(self._now_s)
            self._wanted.call(reason, self._now_s)
            return
        self._time.over()
        self._requests.withdraw_all(reason, self._now_s)
        self._latch.activate(str(reason)[:500], self._now_s, self._seen, self._violated)

    def _end(self, sample: Snapshot | None) -> None:
        """Heartbeat and journal; the lease goes back where only a fallback was left to be sent."""
        parts, now_s = self._parts, self._now_s
        self._modes.settle(now_s, sending=self._sending)
        parts.tenure.beat(now_s)
        self._follow_lease()
        targets = parts.service.news(but=self._arrivals.tags)
        if targets:
            parts.note(TargetsHeld(targets), now_s)
        self._parts.alarms.hold("journal", parts.recorder.trouble, self._now_s)
        lost = parts.recorder.lost
        if lost > self._lost:
            self._lost = lost
            parts.alarms.say("journal:lost", f"{lost} events could not be journalled", Priority.HIGH, now_s)

    @property
    def _sending(self) -> bool:
        """Whether a fallback has not come to stand yet: it is sent whatever the mode."""
        return self.latched is not None and not self._latch.standing

    @property
    def _oldest_s(self) -> float:
        settings = self._parts.settings
        return settings.person_s if self.mode is Mode.APPROVE else settings.check_age_s

    def _alarm(self, name: str, cause: str, priority: Priority) -> None:
        self._parts.alarms.raise_(name, cause, priority, self._now_s)

    def _observed(self) -> Observation:
        sequencer, answers = self._parts.sequencer, self._requests.drain()
        self._wanted.hear(answers)
        entered = sequencer.drain()
        for state, at_s in entered:
            self._parts.note(StateEntered(state), at_s)
        for state, at_s in sequencer.made():
            self._trips.start_up.enter(state, at_s)
        sequence = sequencer.state, sequencer.rest(), sequencer.way(), sequencer.refused, entered
        stand = self.latched, self.mode, answers
        return Observation(
            self._now_s, self._seen, *sequence, *stand, self._sample, self._time.by_s, self._persons.notes(self._now_s)
        )
