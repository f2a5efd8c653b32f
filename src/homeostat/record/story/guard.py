"""What the guard has to say, in the words of a control room: requests, people, modes, alarms and trips."""

import shlex
from collections.abc import Iterator

from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import GuardStarted, RequestAnswered, ThinkingEnded
from homeostat.domain.events.people import (
    AlarmAcknowledged,
    AlarmRaised,
    AlarmReturned,
    AlarmShelved,
    AlarmUnshelved,
    ModeEntered,
    PersonHeard,
    ServiceChanged,
)
from homeostat.domain.events.recovery import Attempted
from homeostat.domain.events.trips import FallbackStands, LatchReset, Tripped
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.request import RequestStatus
from homeostat.journal import Event
from homeostat.record.story.line import Line, Tone
from homeostat.record.story.wording import commands, worst

DIGITS = 12
"""Digits of a digest that are shown; the command that answers finds the others in the journal."""
_TOLD = ("trip:", "latched")
"""Beginnings of alarms whose event has a line of its own."""
_BY_PERSON = {Verb.APPROVE: "approved", Verb.REJECT: "rejected", Verb.START: "started"}
_BY_PERSON[Verb.FALL_BACK] = "ordered the fallback"
"""What a person did; other orders have an event of their own."""
_NOT = {RequestStatus.REFUSED: "refused", RequestStatus.FAILED: "failed", RequestStatus.WITHDRAWN: "withdrawn"}


class GuardStory:
    """Turns the guard's events into lines."""

    def __init__(self, plant: PlantDescription, run_dir: str) -> None:
        """``plant`` knows the operator's words and the units; orders to the run name ``run_dir``."""
        self._plant, self._run_dir = plant, run_dir
        self._mode = Mode.CLOSED_LOOP.value
        self._attempts: dict[str, Attempted] = {}
        self._advised = ""

    def tell(self, event: Event, at_s: float) -> Iterator[Line]:
        """The lines of one event."""
        match event:
            case Attempted():
                self._attempts = {**self._attempts, event.digest: event} if event.approved else self._attempts
            case GuardStarted():
                self._mode = event.mode
                if event.restored:
                    yield Line(at_s, "guard", f"goes on from the journal in mode {event.mode}", Tone.WARNING)
                elif event.mode != Mode.CLOSED_LOOP:
                    yield Line(at_s, "mode", _MEANING[event.mode])
            case ModeEntered() if event.person:
                self._mode = event.mode
                text = f"{_MEANING[event.mode]}; changed by {event.person}{_because(event.reason)}"
                yield Line(at_s, "mode", text, Tone.WARNING)
            case ModeEntered(mode=Mode.OBSERVE.value, reason=reason) if reason:
                self._mode = event.mode
                yield Line(at_s, "mode", f"{_MEANING[event.mode]}; {reason}", Tone.WARNING)
            case ThinkingEnded():
                yield Line(at_s, "thinking", f"{event.reason}; nothing is diagnosed until it is back", Tone.WARNING)
            case RequestAnswered():
                yield from self._answer(event, at_s)
            case PersonHeard():
                yield from _person(event, at_s)
            case ServiceChanged() if event.person:
                way = "back in service" if event.in_service else "out of service"
                yield Line(at_s, "service", f"{event.tag} is {way} by {event.person}{_because(event.reason)}")
            case Tripped():
                acts = "the fallback acts" if event.acted else f"in mode {self._mode} nobody writes: a person must act"
                yield Line(at_s, "trip", f"{event.reason}; {acts}", Tone.BAD)
            case FallbackStands():
                text = f"the plant holds {event.strategy!r}; latched until a person resets it"
                yield Line(at_s, "latched", text, Tone.WARNING)
            case LatchReset():
                text = f"by {' and '.join(event.persons)}: {event.reason}; the plant stands in {event.state!r}"
                if event.candidates:
                    text += f", or in one of {', '.join(n for n in event.candidates if n != event.state)}"
                yield Line(at_s, "reset", text, Tone.GOOD)
            case AlarmRaised() | AlarmReturned() | AlarmAcknowledged() | AlarmShelved() | AlarmUnshelved():
                yield from _alarm(event, at_s)
            case _:
                pass  # the rest is for an engineer, who reads the journal

    def _answer(self, event: RequestAnswered, at_s: float) -> Iterator[Line]:
        status = RequestStatus(event.status)
        if status is RequestStatus.OFFERED:
            run = shlex.quote(self._run_dir)
            order = f"homeostat approve {run} {event.request} --digest {event.digest[:DIGITS]}"
            yield Line(at_s, "offered", f"{self._asked(event)}; waits for a person: {order}", Tone.WARNING)
        elif status is RequestStatus.ADVISED and self._mode == Mode.ADVISE and event.digest != self._advised:
            self._advised = event.digest
            yield Line(at_s, "advice", self._asked(event), Tone.GOOD)
        elif status in _NOT:
            check = f" ({event.check})" if event.check else ""
            text = f"{event.proposer or 'a stranger'}: the guard, because {event.reason}{check}"
            yield Line(at_s, _NOT[status], text, Tone.WARNING)

    def _asked(self, event: RequestAnswered) -> str:
        attempt = self._attempts.get(event.digest)
        if attempt is None:
            return f"{event.request} by {event.proposer}"
        margin = worst(attempt.findings, self._plant.scales)
        what = f"{' > '.join(attempt.path)}: {commands(attempt.commands, self._plant)}"
        return f"{event.request} by {event.proposer}, {what}; {margin}"


_MEANING = {
    Mode.OBSERVE.value: "observe: nobody writes, a trip is an alarm",
    Mode.ADVISE.value: "advise: nobody writes, what would be released is shown",
    Mode.APPROVE.value: "approve: what is proposed waits for a person's yes",
    Mode.CLOSED_LOOP.value: "closed-loop: what passes every check is written",
}


def _because(reason: str) -> str:
    return f": {reason}" if reason else ""


def _person(event: PersonHeard, at_s: float) -> Iterator[Line]:
    """Orders without an event of their own, and all that were refused."""
    about = f" {event.subject}" if event.subject else ""
    if event.missing:
        yield Line(at_s, "person", f"{event.person} ({event.role.value}) ordered {event.verb}{about}; {event.reason}")
    elif not event.done:
        text = f"{event.person} ({event.role.value}) ordered {event.verb}{about}, refused because {event.reason}"
        yield Line(at_s, "person", text, Tone.WARNING)
    elif (done := _BY_PERSON.get(Verb(event.verb))) is not None:
        text = f"{done}{about} by {event.person}" if event.verb != Verb.FALL_BACK else f"{event.person} {done}"
        yield Line(at_s, "person", f"{text}{_because(event.reason)}", Tone.GOOD)


def _alarm(
    event: AlarmRaised | AlarmReturned | AlarmAcknowledged | AlarmShelved | AlarmUnshelved, at_s: float
) -> Iterator[Line]:
    match event:
        case AlarmShelved():
            text = f"{event.alarm} shelved until {event.until_s:.0f} s by {event.person}{_because(event.reason)}"
            yield Line(at_s, "alarm", text, Tone.WARNING)
        case AlarmUnshelved():
            by = f"by {event.person}" if event.person else "as its time is over"
            yield Line(at_s, "alarm", f"{event.alarm} is shown again {by}", Tone.MUTED)
        case AlarmRaised() if not event.alarm.startswith(_TOLD):
            tone = Tone.WARNING if event.priority in (Priority.LOW, Priority.MEDIUM) else Tone.BAD
            yield Line(at_s, "alarm", f"{event.alarm} ({event.priority.value}): {event.cause}", tone)
        case AlarmReturned():
            yield Line(at_s, "alarm", f"{event.alarm} has returned to normal", Tone.MUTED)
        case AlarmAcknowledged():
            yield Line(at_s, "alarm", f"{event.alarm} acknowledged by {event.person}", Tone.MUTED)
        case _:
            pass
