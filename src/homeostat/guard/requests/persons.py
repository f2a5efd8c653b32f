"""People: their orders are carried out by the guard, checked once, answered and journalled."""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from homeostat.domain.alarm import Priority
from homeostat.domain.events.people import ModeEntered, PersonHeard
from homeostat.domain.events.trips import LatchReset
from homeostat.domain.events.writes import Cause
from homeostat.domain.mode import Mode, PersonCommand, Role, Side, Verb
from homeostat.domain.recovery import ActionSet
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.parts import Parts
from homeostat.guard.requests.authority import Authority, no_alarm, no_start, unchanged_service
from homeostat.guard.requests.requests import Requests
from homeostat.guard.requests.verification import Present, Unfit, verify_start
from homeostat.guard.sequence.recognition import recognise
from homeostat.guard.sequence.sequencer import loaded, nominal_commands, what_follows
from homeostat.guard.sequence.steps import Steps
from homeostat.guard.texts import LONGEST_NAME, brief, said
from homeostat.guard.watch.shelf import Shelf
from homeostat.guard.writing.flight import Failed, Progress, Write
from homeostat.guard.writing.tenure import Modes

MOST_NOTES: Final = 3
"""Notes that are kept for proposers."""
NOTED_S: Final = 3600.0
"""How long proposers are shown a note, process time [s]."""


@dataclass(frozen=True, slots=True)
class Counted:
    """An order that counts, and is carried out once others order it too."""

    missing: int
    """How many others."""
    text: str
    """The same in words."""


@dataclass(frozen=True, slots=True)
class Floor:
    """What people's orders act on."""

    parts: Parts
    """The guard's parts."""
    modes: Modes
    """Who may write."""
    latch: Latch
    """Fallback and latch."""
    requests: Requests
    """What waits for a person."""
    steps: Steps
    """What was released and is still to come."""


class Persons:
    """Carries out what people order."""

    def __init__(self, floor: Floor) -> None:
        """``floor``: what orders act on."""
        self._floor = floor
        settings = floor.parts.settings
        self._authority = Authority(settings.persons, settings.person_s, settings.order_s)
        self._shelf = Shelf(floor.parts.alarms, floor.parts.note)
        self._notes: deque[tuple[float, str]] = deque(maxlen=MOST_NOTES)
        self._starting: tuple[Write, str, ActionSet] | None = None
        self._unread: tuple[Write, str] | None = None
        self._orders: dict[Verb, Callable[[PersonCommand, Present], str | Counted]] = {
            Verb.APPROVE: lambda given, present: floor.requests.agree(given.subject, given.digest),
            Verb.REJECT: lambda given, present: floor.requests.reject(
                given.subject, f"{given.person}: {given.reason}", present.now_s
            ),
            Verb.RESET: self._reset,
            Verb.MODE: self._mode,
            Verb.IN_SERVICE: self._service,
            Verb.OUT_OF_SERVICE: self._service,
            Verb.ACKNOWLEDGE: self._acknowledge,
            Verb.SHELVE: lambda given, present: self._shelf.shelve(given, present.now_s),
            Verb.UNSHELVE: lambda given, present: self._shelf.unshelve(given, present.now_s),
            Verb.FALL_BACK: self._fall_back,
            Verb.START: self._start,
            Verb.NOTE: self._note,
        }

    def hear(self, command: PersonCommand, present: Present) -> None:
        """Carry out ``command`` if nothing is against it, and journal what came of it."""
        objection, check, missing = self._authority.objection(command), "", 0
        if not objection:
            try:
                came = self._orders[command.verb](command, present)
                objection, missing = (came.text, came.missing) if isinstance(came, Counted) else (came, 0)
            except Unfit as unfit:
                objection, check = unfit.finding.message, unfit.finding.criterion
            except BaseException as error:  # whoever orders something gets an answer
                objection = f"the order could not be carried out: {said(error)}"
        name, person, verb, subject = (
            brief(given, LONGEST_NAME) for given in (command.id, command.person, command.verb, command.subject)
        )
        self._authority.remember((name,))
        role = command.role if isinstance(command.role, Role) else Role.OPERATOR
        reason = objection or brief(command.reason)
        event = PersonHeard(name, person, role, verb, subject, not objection, reason, check, missing)
        self._floor.parts.note(event, present.now_s)

    def remember(self, used: Iterable[str]) -> None:
        """Orders that were answered before a restart are not carried out again."""
        self._authority.remember(used)

    def notes(self, now_s: float) -> tuple[str, ...]:
        """What people have noted for proposers to read within :data:`NOTED_S`, the latest first."""
        return tuple(text for at_s, text in reversed(self._notes) if now_s - at_s <= NOTED_S)

    def _note(self, command: PersonCommand, present: Present) -> str:
        """Proposers read it; nothing is decided by it."""
        self._notes.append((present.now_s, brief(command.reason)))
        return ""

    def expire(self, now_s: float) -> None:
        """What people have ordered for a time is over then."""
        self._shelf.expire(now_s)

    def follow(self, write: Write | None, progress: Progress | Failed | None, now_s: float) -> None:
        """Take note of how far ``write`` has come: a start is made once the plant has got its commands.

        Nothing follows behind one that the plant takes and does not hold, or that something overtakes before that.
        """
        starting, parts = self._starting, self._floor.parts
        made = parts.writer.accepted or progress is Progress.CONFIRMED
        if starting is not None and write is starting[0] and made:
            self._starting, self._unread = None, (starting[0], starting[1])
            parts.sequencer.load(starting[2], now_s)
            parts.note(loaded(starting[1], starting[2], aborting=False), now_s)
        if self._unread is None:
            return
        if write is not self._unread[0] or isinstance(progress, Failed):
            self._give_up(self._unread[1], now_s)
        elif progress is Progress.CONFIRMED:
            self._unread = None

    def _give_up(self, start: str, now_s: float) -> None:
        """Nothing follows ``start``, which the plant was not read to hold; what a fallback has loaded since stays."""
        self._unread, parts = None, self._floor.parts
        if self._floor.latch.reason is None:
            parts.sequencer.stop()
            parts.note(loaded(start, ActionSet((), parts.sequencer.state), aborting=False), now_s)

    def _acknowledge(self, command: PersonCommand, present: Present) -> str:
        alarms = self._floor.parts.alarms
        if alarms.acknowledge(command.subject, command.person, present.now_s):
            return ""
        return no_alarm(command.subject, (alarm.id for alarm in alarms.standing))

    def _service(self, command: PersonCommand, present: Present) -> str:
        service, into = self._floor.parts.service, command.verb is Verb.IN_SERVICE
        if service.change(command.subject, into, command.person, command.reason, present.now_s):
            if into:
                self._floor.parts.alarms.return_(f"moved:{command.subject}", present.now_s)
            return ""
        return unchanged_service(command.subject, self._floor.parts.rules, service)

    def stand_back(self, reason: str, now_s: float) -> None:
        """Go down to observe without a person's order, because of ``reason``; a person must raise the mode again."""
        if self._floor.modes.mode is not Mode.OBSERVE:
            why = brief(reason)
            self._enter(Mode.OBSERVE, ModeEntered(Mode.OBSERVE.value, "", why), why, now_s)
            self._floor.parts.alarms.say("mode:observe", f"observe only: {why}", Priority.HIGH, now_s)

    def _mode(self, command: PersonCommand, present: Present) -> str | Counted:
        mode = Mode(command.subject)
        if self._floor.latch.reason is not None and mode.writes:
            return "a fallback is latched; reset it first"
        agreed: tuple[str, ...] = (command.person,)
        if mode is Mode.CLOSED_LOOP:
            agreed = self._authority.agree(command, present.now_s)
            if not agreed:
                return self._counted(command)
        who = " and ".join(agreed)
        why = f"{who} changed the mode"
        return self._enter(mode, ModeEntered(mode.value, brief(who), command.reason), why, present.now_s)

    def _enter(self, mode: Mode, entered: ModeEntered, why: str, now_s: float) -> str:
        """Go over to ``mode``, and have nothing of the one before go on; why not, or empty."""
        floor = self._floor
        objection = floor.modes.enter(mode, now_s)
        if objection:
            return objection
        self._authority.forget(Verb.MODE)  # whoever agreed to closed loop did so in the mode before
        if floor.latch.reason is None:  # a fallback is sent until it stands, whatever the mode
            floor.parts.writer.overtake(now_s, why)
        if entered.person:
            why += f" to {mode.value!r}"
        if self._unread is not None:
            text = f"{why} before the plant was read to hold {self._unread[1]!r}: nothing follows it"
            floor.parts.alarms.say("write:person", text, Priority.HIGH, now_s)
            self._give_up(self._unread[1], now_s)
        floor.requests.withdraw_all(why, now_s)
        if not mode.writes:
            floor.steps.withdraw(why, now_s)
        floor.parts.note(entered, now_s)
        return ""

    def _reset(self, command: PersonCommand, present: Present) -> str | Counted:
        floor, now_s, readings = self._floor, present.now_s, present.readings
        if floor.latch.reason is None:
            return "nothing is latched"
        if readings is None or not (floor.latch.standing or floor.parts.alarms.lasts("shed")):
            return "the fallback is not confirmed by the plant yet; a reset would leave it half done"
        if not readings.accepted or now_s - readings.at_s > floor.parts.settings.again_s:
            return "the plant does not answer; nobody can say in which state it would be left"
        agreed = self._authority.agree(command, now_s)
        if not agreed:
            return self._counted(command)
        rules, sequencer = floor.parts.rules, floor.parts.sequencer
        found = recognise(rules.machine, floor.parts.evidence(readings), sequencer.state, rules.start_up.states)
        floor.latch.reset(now_s)
        floor.modes.enter(Mode.OBSERVE, now_s)
        self._authority.forget(Verb.MODE)
        sequencer.restore(found.state, (), aborting=False)
        if found.candidates:
            floor.parts.alarms.say("position", str(found), Priority.MEDIUM, now_s)
        floor.parts.note(LatchReset(agreed, command.reason, found.state, found.candidates), now_s)
        floor.parts.note(ModeEntered(Mode.OBSERVE.value, command.person, "reset"), now_s)
        return ""

    def _counted(self, command: PersonCommand) -> Counted:
        """An order that more people must give."""
        persons, missing = self._floor.parts.settings.persons, self._authority.missing(command.verb)
        others = "another person" if missing == 1 else f"{missing} other people"
        login = f"; all who order as login {brief(command.login, 40)!r} are one person" if command.login else ""
        return Counted(missing, f"{persons - missing} of {persons} people; {others} must order it too{login}")

    def _fall_back(self, command: PersonCommand, present: Present) -> str:
        floor = self._floor
        if not floor.modes.mode.writes:
            return f"in mode {floor.modes.mode.value!r} nobody writes"
        if floor.latch.reason is not None:
            return "a fallback has acted already"
        floor.requests.withdraw_all("a person ordered the fallback", present.now_s)
        reason = f"ordered by {command.person}: {command.reason}"
        floor.latch.activate(reason, present.now_s, present.readings, present.violated)
        return ""

    def _start(self, command: PersonCommand, present: Present) -> str:
        """Take a transition that leads back to a start, with the design commands of its target state."""
        floor = self._floor
        rules, writer, now_s = floor.parts.rules, floor.parts.writer, present.now_s
        leaving = (t for t in rules.machine.transitions if t.source == present.state and t.on_decision)
        found = next((t for t in leaving if t.name == command.subject), None)
        if floor.latch.reason is not None:
            return "a fallback is latched; reset it first"
        if not floor.modes.mode.writes:
            return f"a start needs a mode that writes; this one is {floor.modes.mode.value!r}"
        if floor.parts.tenure.lost:
            return f"the lease is lost: {floor.parts.tenure.lost}"
        if found is None:
            return no_start(command.subject, rules, present.state)
        if present.readings is None:
            return "there is no reading to decide on"
        by_state = nominal_commands(rules)
        guards = rules.recipe is Side.GUARD  # else the plant's own recipe goes on from there
        then = what_follows(rules.machine, found.target, by_state) if guards else ()
        actions = ActionSet(by_state[found.target], found.target, then)
        verify_start(found, actions, rules, present)
        if writer.flying is not None:
            return "another write is under way; order it again"
        write = Write.of(Cause.PERSON, command.person, actions)
        if not writer.begin(write, now_s):
            return f"the intention could not be journalled: {floor.parts.recorder.trouble}"
        floor.requests.withdraw_all(f"{command.person} ordered a start", now_s)
        self._starting = (write, command.subject, actions)
        self.follow(write, None, now_s)
        return ""
