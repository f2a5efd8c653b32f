"""The writer: the only way to the plant, with at most one write in flight.

Intention journalled and synced, sent, read back within the table's tolerance and time, tried again under a number of
its own, result journalled. It never waits: a tick asks how far the write has come.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeAlias

from homeostat.domain.events.writes import Cause, ReadBack, StepLoaded, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.plant.rules import WriteRule
from homeostat.domain.ports import Wire
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.restart.recorder import URGENT_S, Recorder
from homeostat.guard.settings import GuardSettings
from homeostat.guard.texts import said
from homeostat.guard.writing.bounded import BoundedWire
from homeostat.guard.writing.flight import Failed, Flight, GivenUp, Progress, Write, between, holds, outcome, same
from homeostat.guard.writing.ramp import Ramps

REMEMBERED = 100
"""Writes that were given up and not read yet, and commands that may still arrive, each."""

Objection: TypeAlias = Callable[[Write, Snapshot], str]
"""A write and the readings after its last attempt -> why it may not be tried again; empty where it may."""


class Writer:
    """Sends one write at a time and follows it until the plant was read back."""

    def __init__(self, rules: Mapping[str, WriteRule], recorder: Recorder, settings: GuardSettings) -> None:
        """``rules``: writable tag -> how it is read back."""
        self._rules, self._recorder, self._settings = rules, recorder, settings
        self._wire: Wire | None = None
        self._flight: Flight | None = None
        self._given_up: deque[Flight] = deque(maxlen=REMEMBERED)
        self._may_arrive: deque[Command] = deque(maxlen=REMEMBERED)
        self._ramps = Ramps()
        self.numbered = 0
        """Writes so far."""

    @property
    def wire(self) -> Wire | None:
        """The writing side of the link; None in modes that do not write."""
        return self._wire

    @property
    def flying(self) -> Write | None:
        """The write that is under way."""
        return self._flight.write if self._flight else None

    @property
    def accepted(self) -> bool:
        """Whether the link has taken the write under way."""
        return self._flight is not None and self._flight.accepted_s is not None

    @property
    def broken(self) -> bool:
        """Whether the link has refused the attempt under way."""
        return self._flight is not None and self._flight.ended and self._flight.accepted_s is None

    @property
    def pending(self) -> frozenset[str]:
        """Tags whose target is not known, because what was sent to them is not confirmed."""
        return frozenset(c.tag for flight in self._open for c in flight.write.commands)

    def expects(self, tag: str, target: float | None) -> bool:
        """Whether what is pending may have brought ``tag`` to ``target``."""
        tolerance = self._tolerance(tag)
        sent = (c.value for flight in self._open for c in flight.write.commands if c.tag == tag)
        return any(same(v, target, tolerance) for v in sent) or self._ramps.passes(tag, target, tolerance)

    def see(self, readings: Snapshot) -> tuple[Command, ...]:
        """Take note of what the plant holds now of what was sent; what it holds of the write under way."""
        self._ramps.present(readings.accepted)
        held: tuple[Command, ...] = ()
        for flight in self._open:
            new = readings.at_s > flight.sent_s
            commands = flight.write.commands if new else ()
            held = tuple(c for c in commands if holds(c, readings, self._tolerance(c.tag)))
            flight.read |= readings.accepted.keys() if new else set()
            flight.held |= {c.tag for c in held} - flight.covered
        return held if self._flight else ()

    def by_hand(self, tag: str, before: float | None, target: float | None) -> bool:
        """Whether it was a person who moved ``tag`` from ``before`` to ``target`` while it is being written.

        It was where the plant had come to what was sent and has left it again, or where ``target`` is off the way from
        ``before`` to what was sent. What is still at ``before``, or on the way, is late, clamped or not obeyed yet, and
        is sent again; from automatic every target is on the way, because nobody knows where the plant held it.
        """
        assert self._flight is not None, "nothing is being written"
        sent = next((c for c in self._flight.write.commands if c.tag == tag), None)
        if sent is None or tag in self._flight.held:
            return True
        return before is not None and not between(target, before, sent.value, self._tolerance(tag))

    def without(self, tag: str) -> bool:
        """Send no more to ``tag`` with the write under way; False where nothing is left to send."""
        assert self._flight is not None, "nothing is being written"
        write = self._flight.write
        kept = tuple(c for c in write.commands if c.tag != tag)
        digest = ActionSet(kept, write.state, write.then).digest if write.digest else ""
        self._flight.write = replace(write, commands=kept, digest=digest)
        return bool(kept)

    def attach(self, wire: Wire) -> None:
        """Send over ``wire`` from now on."""
        self._wire = wire

    def detach(self) -> None:
        """The wire is given back: nothing is sent any more."""
        self._wire = None

    def cut(self) -> None:
        """The wire is lost: nothing is sent any more, ramps stand where they are."""
        self._wire = None
        self._ramps.stop()

    def begin(self, write: Write, now_s: float) -> bool:
        """Send ``write`` now; False, and nothing is sent, where its intention cannot be journalled.

        Only a fallback and the steps of a sequence that runs already are sent without a journal: a disk that is full
        must not keep a valve from closing. AssertionError where another write is under way.
        """
        assert self._flight is None, "one write at a time; overtake the other one first"
        self.numbered += 1
        flight = Flight(write, self.numbered, 0, None, now_s)
        if not self._send(flight, now_s):
            return False
        for given_up in self._given_up:
            given_up.cover({c.tag for c in write.commands})
        self._flight = flight
        return True

    def repeat(self, now_s: float) -> None:
        """The next attempt at once: there is a new wire, and what went over the last one may be lost with it."""
        flight = self._flight
        if flight is not None and flight.attempt < self._settings.attempts:
            if not flight.ended:
                self._end(flight, WriteResult.GIVEN_UP, "the wire was lost", now_s)
            self._send(flight, now_s)

    def overtake(self, now_s: float, reason: str) -> None:
        """Give up what is under way, ramps included; what was on the wire is read back later."""
        self._ramps.stop()
        flight, self._flight = self._flight, None
        if flight is None:
            return
        if not flight.ended:
            self._end(flight, WriteResult.GIVEN_UP, reason, now_s)
        self._give_up(flight)

    def late(self, tag: str, target: float | None) -> bool:
        """Whether ``target`` is what a write that was given up would have brought ``tag`` to; said once per attempt."""
        for command in self._may_arrive:
            if command.tag == tag and same(command.value, target, self._tolerance(tag)):
                self._may_arrive.remove(command)
                return True
        return False

    def ramped(self, readings: Snapshot) -> tuple[Command, ...]:
        """How far the guard's own ramps have brought the targets of what is pending."""
        held = readings.accepted.items()
        return tuple(Command(t, v, None) for t, v in held if self._ramps.passes(t, v, self._tolerance(t)))

    def leave(self, tag: str) -> None:
        """Ramp ``tag`` no further: somebody else has moved it."""
        self._ramps.drop(tag)

    def forget(self) -> None:
        """What was given up is not expected any more: whoever brings a tag there now means it."""
        self._may_arrive.clear()

    def follow(
        self, now_s: float, readings: Snapshot | None, objection: Objection = lambda write, readings: ""
    ) -> Progress | Failed | None:
        """How far the write under way has come with these readings; None where nothing is new.

        ``objection`` says why a write may not be tried again now; nobody asks it about a fallback.
        """
        self._ramp(now_s, {} if readings is None else readings.accepted)
        flight = self._flight
        if flight is None:
            return None
        after = readings if readings is not None and readings.at_s > flight.sent_s else None
        if after is not None and not self._deviating(flight.write, after):
            return self._confirm(flight, now_s)
        if not flight.ended:
            return self._answered(flight, now_s)
        if flight.accepted_s is not None:
            waits = now_s - max(flight.accepted_s, self._ramps.followed_s) < self._confirm_s(flight.write)
        else:
            waits = after is None and now_s - flight.sent_s < self._settings.write_s
        return None if waits else self._again(flight, now_s, after, objection)

    def read_given_up(self, now_s: float, readings: Snapshot | None) -> tuple[GivenUp, ...]:
        """Say what became of writes that were given up, once the plant was read after them; those that were read."""
        if readings is None or self._flight is not None:
            return ()
        read = [flight for flight in self._given_up if readings.at_s > flight.sent_s]
        for flight in read:
            self._read_back(flight, readings, now_s)
            self._given_up.remove(flight)
        self._settle()
        return tuple(outcome(flight) for flight in read)

    @property
    def _open(self) -> list[Flight]:
        """Writes of which nobody has read yet what became of them; the one under way is the last."""
        return [*self._given_up, *([self._flight] if self._flight else [])]

    def _settle(self) -> None:
        """Where everything that was sent is read, no ramp that has ended is on its way any more."""
        if not self._open:
            self._ramps.forget()

    def _give_up(self, flight: Flight) -> None:
        """What was sent is read later, and may arrive later still, once per attempt."""
        self._given_up.append(flight)
        self._may_arrive.extend(flight.write.commands * flight.attempt)

    def _answered(self, flight: Flight, now_s: float) -> Progress | None:
        """Whether the link has said something of the attempt."""
        try:
            assert flight.ticket is not None, "the link gave no ticket"
            done, error = flight.ticket.done, str(flight.ticket.error)
        except BaseException as broken:  # a link may break in any way
            done, error = True, said(broken)
        if done and not error:
            flight.accepted_s = now_s
            self._end(flight, WriteResult.ACCEPTED, "", now_s)
            return Progress.ACCEPTED
        if done:
            self._end(flight, WriteResult.FAILED, error, now_s)
        elif now_s - flight.sent_s >= self._settings.write_s:
            self._end(flight, WriteResult.TIMED_OUT, f"no answer for {now_s - flight.sent_s:g} s", now_s)
        return None

    def _again(self, flight: Flight, now_s: float, after: Snapshot | None, objection: Objection) -> Failed | None:
        """The next attempt, where nothing is against it; ``after``: the plant as it was read after the last one."""
        if after is not None:
            self._read_back(flight, after, now_s)
        why = ""
        if flight.write.cause is not Cause.FALLBACK:
            why = objection(flight.write, after) if after is not None else "the plant was not read after the attempt"
        if why:
            flight.error = why
        elif flight.attempt < self._settings.attempts and self._send(flight, now_s):
            return None
        self._flight = None
        self._ramps.stop()
        if after is None:
            self._give_up(flight)
        else:
            self._may_arrive.extend(flight.write.commands * flight.attempt)
        self._settle()
        told = () if after is None else [t for t in self._deviating(flight.write, after) if t in after.accepted]
        return Failed(flight.error, None if after is None else outcome(flight), unread=not told)

    def _send(self, flight: Flight, now_s: float) -> bool:
        """One attempt with an intention of its own; False where its intention cannot be journalled."""
        write = flight.write
        flight.attempt += 1
        flight.ticket, flight.ended, flight.accepted_s, flight.sent_s = None, False, None, now_s
        steps = tuple(StepLoaded(s.transition.name, s.commands) for s in write.then)
        intention = WriteIntended(
            flight.number, flight.attempt, write.cause, write.source, write.commands, write.digest, write.state, steps
        )
        self._recorder.note(intention, now_s)
        urgent = write.cause is Cause.FALLBACK
        if not self._recorder.commit(URGENT_S if urgent else math.inf) and write.cause in (Cause.REQUEST, Cause.PERSON):
            self._end(flight, WriteResult.GIVEN_UP, "the intention could not be journalled", now_s)
            return False
        try:
            wire = self._way(write)
            first = self._ramps.first(write.commands, self._rules, anyway=urgent)
            flight.ticket = wire.send(first)
        except BaseException as broken:  # a link may break in any way; what it did is read back
            self._end(flight, WriteResult.FAILED, said(broken), now_s)
            return True
        self._answered(flight, now_s)
        return True

    def _end(self, flight: Flight, result: WriteResult, detail: str, now_s: float) -> None:
        flight.ended, flight.error = True, detail
        self._recorder.note(WriteEnded(flight.number, flight.attempt, result, detail), now_s)

    def _confirm(self, flight: Flight, now_s: float) -> Progress:
        if not flight.ended:
            self._end(flight, WriteResult.ACCEPTED, "", now_s)
        tags = tuple(c.tag for c in flight.write.commands)
        self._may_arrive.extend(flight.write.commands * (flight.attempt - 1))  # attempts before may be on the wire yet
        self._recorder.note(ReadBack(flight.number, tags), now_s)
        self._flight = None
        self._ramps.stop()
        self._settle()
        return Progress.CONFIRMED

    def _read_back(self, flight: Flight, readings: Snapshot, now_s: float) -> None:
        deviating = self._deviating(flight.write, readings)
        confirmed = tuple(c.tag for c in flight.write.commands if c.tag not in deviating)
        self._recorder.note(ReadBack(flight.number, confirmed, deviating), now_s)

    def _way(self, write: Write) -> Wire:
        """The wire; what hangs in a link that may block holds no fallback up. ConnectionError where there is none."""
        if self._wire is None:
            raise ConnectionError("there is no lease to write with")
        if write.cause is Cause.FALLBACK and isinstance(self._wire, BoundedWire):
            return self._wire.urgent
        return self._wire

    def _ramp(self, now_s: float, told: Mapping[str, float | None]) -> None:
        """Take the next step of every ramp that the guard makes, once the link has taken the first."""
        flight = self._flight
        if flight is None or not (flight.accepted_s is not None or flight.write.cause is Cause.FALLBACK):
            return

        def held(tag: str, target: float | None, value: float) -> bool:
            return same(value, target, self._tolerance(tag))

        commands = self._ramps.step(now_s, told, held, anyway=flight.write.cause is Cause.FALLBACK)
        if commands:
            try:
                self._way(flight.write).send(commands)
                self._ramps.took(commands, now_s, told)
            except BaseException as broken:  # whether the plant has it is read; the same step is sent again
                flight.error = said(broken)

    def _deviating(self, write: Write, readings: Snapshot) -> tuple[str, ...]:
        """Tags whose accepted target is not what was commanded."""
        return tuple(c.tag for c in write.commands if not holds(c, readings, self._tolerance(c.tag)))

    def _tolerance(self, tag: str) -> float:
        return self._rules[tag].tolerance if tag in self._rules else 0.0

    def _confirm_s(self, write: Write) -> float:
        """Time in which the plant must have accepted every command, or every step of a guard's ramp [s]."""
        return max((self._rules[c.tag].confirm_s for c in write.commands if c.tag in self._rules), default=0.0)
