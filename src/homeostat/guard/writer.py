"""The writer: the only way to the plant, with at most one write in flight.

Intention journalled and synced, sent, read back within the table's tolerance and time, tried again under a number of
its own, result journalled. It never waits: a tick asks how far the write has come.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from homeostat.domain.guard_events import Cause, ReadBack, StepLoaded, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.mode import Side
from homeostat.domain.ports import Ticket, Wire
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.rules import WriteRule
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.ramp import Ramps
from homeostat.guard.recorder import Recorder
from homeostat.guard.settings import GuardSettings


@dataclass(frozen=True, slots=True)
class Write:
    """Commands that belong together, and on whose behalf they are sent."""

    cause: Cause
    """On whose behalf."""
    source: str
    """Name of the request, strategy, transition or person."""
    commands: tuple[Command, ...]
    """What is sent, in order."""
    state: str
    """State of the machine that they lead to."""
    digest: str = ""
    """Digest of the action set that they begin; empty where there is none."""
    then: tuple[Step, ...] = ()
    """What follows once the plant has taken them."""

    @classmethod
    def of(cls, cause: Cause, source: str, actions: ActionSet) -> Write:
        """The write that begins ``actions``."""
        return cls(cause, source, actions.commands, actions.target, actions.digest, actions.then)


class Progress(StrEnum):
    """How far a write has come."""

    ACCEPTED = "accepted"
    """The link has just taken it; its effect is not read yet."""
    CONFIRMED = "confirmed"
    """The plant holds every target."""
    FAILED = "failed"
    """Every attempt was made, and the plant does not hold every target."""


@dataclass(slots=True)
class _Flight:
    """The write that is under way."""

    write: Write
    number: int
    attempt: int
    ticket: Ticket | None
    sent_s: float
    accepted_s: float | None = None
    ended: bool = False


class Writer:
    """Sends one write at a time and follows it until the plant was read back."""

    def __init__(self, rules: Mapping[str, WriteRule], recorder: Recorder, settings: GuardSettings) -> None:
        """``rules``: writable tag -> how it is read back."""
        self._rules, self._recorder, self._settings = rules, recorder, settings
        self._flight: _Flight | None = None
        self._given_up: list[_Flight] = []
        self._overtaken: deque[Command] = deque(maxlen=100)
        self._ramps = Ramps()
        self.numbered = 0
        """Writes so far."""
        self.wire: Wire | None = None
        """The writing side of the link; None in modes that do not write."""
        self.error = ""
        """What the link said last when it failed."""

    @property
    def flying(self) -> Write | None:
        """The write that is under way."""
        return self._flight.write if self._flight else None

    @property
    def accepted(self) -> bool:
        """Whether the link has taken the write under way."""
        return self._flight is not None and self._flight.accepted_s is not None

    @property
    def pending(self) -> frozenset[str]:
        """Tags whose target is not known, because what was sent to them is not confirmed."""
        flights = [*self._given_up, *([self._flight] if self._flight else [])]
        return frozenset(c.tag for f in flights for c in f.write.commands)

    def begin(self, write: Write, now_s: float) -> bool:
        """Send ``write`` now; False, and nothing is sent, where its intention cannot be journalled.

        Only a fallback and the steps of a sequence that runs already are sent without a journal: a disk that is full
        must not keep a valve from closing. AssertionError where another write is under way.
        """
        assert self._flight is None, "one write at a time; overtake the other one first"
        self.numbered += 1
        flight = _Flight(write, self.numbered, 0, None, now_s)
        if not self._send(flight, now_s):
            return False
        self._flight = flight
        return True

    def overtake(self, now_s: float, reason: str) -> None:
        """Give up what is under way, ramps included; what was on the wire is read back later."""
        self._ramps.stop()
        flight, self._flight = self._flight, None
        if flight is None:
            return
        if not flight.ended:
            self._end(flight, WriteResult.GIVEN_UP, reason, now_s)
        self._given_up.append(flight)
        self._overtaken.extend(flight.write.commands)

    def late(self, tag: str, target: float | None) -> bool:
        """Whether ``target`` is what an overtaken write would have brought ``tag`` to: it arrived after all."""
        return any(c.tag == tag and c.value == target for c in self._overtaken)

    def follow(self, now_s: float, readings: Snapshot | None) -> Progress | None:
        """How far the write under way has come with these readings; None where nothing is new."""
        if readings is not None:
            self._ramps.present(readings.accepted)
        self._ramp(now_s)
        flight = self._flight
        if flight is None:
            return None
        fresh = readings is not None and readings.at_s > flight.sent_s
        if fresh and readings is not None and not self._deviating(flight.write, readings):
            return self._confirm(flight, now_s)
        if not flight.ended:
            return self._answered(flight, now_s)
        waited_s = now_s - (flight.sent_s if flight.accepted_s is None else flight.accepted_s)
        allowed_s = self._settings.write_s if flight.accepted_s is None else self._confirm_s(flight.write)
        if waited_s < allowed_s and not (flight.accepted_s is None and fresh):
            return None
        return self._again(flight, now_s, readings)

    def read_given_up(self, now_s: float, readings: Snapshot | None) -> None:
        """Say what became of writes that were overtaken, once the plant was read after them."""
        if readings is None or self._flight is not None:
            return
        for flight in self._given_up:
            self._read_back(flight, readings, now_s)
        self._given_up.clear()

    def _answered(self, flight: _Flight, now_s: float) -> Progress | None:
        """Whether the link has said something of the attempt."""
        assert flight.ticket is not None  # an attempt that could not be sent has ended
        try:
            done, error = flight.ticket.done, flight.ticket.error
        except Exception as broken:  # a link may break in any way
            done, error = True, str(broken) or type(broken).__name__
        if done and not error:
            flight.accepted_s = now_s
            self._end(flight, WriteResult.ACCEPTED, "", now_s)
            return Progress.ACCEPTED
        if done:
            self._end(flight, WriteResult.FAILED, error, now_s)
        elif now_s - flight.sent_s >= self._settings.write_s:
            self._end(flight, WriteResult.TIMED_OUT, f"no answer for {now_s - flight.sent_s:g} s", now_s)
        return None

    def _again(self, flight: _Flight, now_s: float, readings: Snapshot | None) -> Progress | None:
        if readings is not None:
            self._read_back(flight, readings, now_s)
        if flight.attempt < self._settings.attempts and self._send(flight, now_s):
            return None
        self._flight = None
        return Progress.FAILED

    def _send(self, flight: _Flight, now_s: float) -> bool:
        """One attempt with an intention of its own; False where its intention cannot be journalled."""
        write = flight.write
        flight.attempt += 1
        flight.ticket, flight.ended, flight.accepted_s, flight.sent_s = None, False, None, now_s
        steps = tuple(StepLoaded(s.transition.name, s.commands) for s in write.then)
        intention = WriteIntended(
            flight.number, flight.attempt, write.cause, write.source, write.commands, write.digest, write.state, steps
        )
        self._recorder.note(intention, now_s)
        if not self._recorder.commit() and write.cause in (Cause.REQUEST, Cause.PERSON):
            self._end(flight, WriteResult.GIVEN_UP, "the intention could not be journalled", now_s)
            return False
        try:
            assert self.wire is not None, "nobody may write in this mode"
            flight.ticket = self.wire.send(self._ramps.first(write.commands, self._rules))
        except Exception as broken:  # a link may break in any way; what it did is read back
            self._end(flight, WriteResult.FAILED, str(broken) or type(broken).__name__, now_s)
            return True
        self._answered(flight, now_s)
        return True

    def _end(self, flight: _Flight, result: WriteResult, detail: str, now_s: float) -> None:
        flight.ended = True
        self.error = detail
        self._recorder.note(WriteEnded(flight.number, flight.attempt, result, detail), now_s)

    def _confirm(self, flight: _Flight, now_s: float) -> Progress:
        if not flight.ended:
            flight.accepted_s = now_s
            self._end(flight, WriteResult.ACCEPTED, "", now_s)
        tags = tuple(c.tag for c in flight.write.commands)
        self._recorder.note(ReadBack(flight.number, tags), now_s)
        self._flight = None
        return Progress.CONFIRMED

    def _read_back(self, flight: _Flight, readings: Snapshot, now_s: float) -> None:
        deviating = self._deviating(flight.write, readings)
        confirmed = tuple(c.tag for c in flight.write.commands if c.tag not in deviating)
        self._recorder.note(ReadBack(flight.number, confirmed, deviating), now_s)

    def _ramp(self, now_s: float) -> None:
        """Take the next step of every ramp that the guard makes."""
        commands = self._ramps.step(now_s)
        if commands and self.wire is not None:
            try:
                self.wire.send(commands)
            except Exception as broken:  # the end of the ramp is read back like any other target
                self.error = str(broken) or type(broken).__name__

    def _deviating(self, write: Write, readings: Snapshot) -> tuple[str, ...]:
        """Tags whose accepted target is not what was commanded."""
        return tuple(
            c.tag for c in write.commands
            if not holds(c, readings, self._rules[c.tag].tolerance if c.tag in self._rules else 0.0)
        )  # fmt: skip

    def _confirm_s(self, write: Write) -> float:
        """Time in which the plant must have accepted every command [s]; a guard's ramp takes its own."""
        found = 0.0
        for c in write.commands:
            rule = self._rules.get(c.tag)
            if rule is not None:
                ramp_s = self._ramps.left_s(c.tag) if rule.ramped_by is Side.GUARD else 0.0
                found = max(found, rule.confirm_s + ramp_s)
        return found


def holds(command: Command, readings: Snapshot, tolerance: float) -> bool:
    """Whether the plant has accepted the target of ``command``; a target that it does not tell is not known to hold."""
    if command.tag not in readings.accepted:
        return False
    target = readings.accepted[command.tag]
    if command.value is None or target is None:
        return command.value is None and target is None
    return abs(target - command.value) <= tolerance
