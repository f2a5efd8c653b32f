"""What comes next, derived in this one place: how urgent it is, how long is left and until what, and who must act."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from homeostat.console.card.foresight import first_limit
from homeostat.console.drawn import held_s
from homeostat.console.situation import Situation
from homeostat.domain.alarm import Priority
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.mode import Mode
from homeostat.domain.plant.description import PlantDescription
from homeostat.guard.settings import GuardSettings

_ORDER: Final = tuple(Priority)
NOTHING: Final = "normal"
"""Level at which nothing is abnormal."""
_THINKS_S: Final = 60.0
"""After the last sign that recovery works on an answer, how long it is said to do so [s]."""
_LIKELY: Final = 0.5
"""Where members that are worth so much reach a limit, it is expected [1]."""


class Until(StrEnum):
    """What the time that is left ends with."""

    NOTHING = "nothing"
    """Nothing is wrong, and nothing has a time."""
    CLEAR = "clear"
    """The twin looked ahead, and no hard limit is reached."""
    FALLBACK = "fallback"
    """A fallback acts by itself."""
    LIMIT = "limit"
    """A hard limit is reached."""
    PASSED = "passed"
    """A hard limit was to be reached by now."""
    BEYOND = "beyond"
    """A hard limit is violated."""
    ACTED = "acted"
    """A fallback has acted."""
    UNKNOWN = "unknown"
    """Nobody knows what follows."""
    ENDED = "ended"
    """The run has ended."""


@dataclass(frozen=True, slots=True)
class TimeLeft:
    """How long is left, and until what."""

    until: Until
    """What it ends with."""
    from_s: float | None
    """When that is at the earliest, process time [s]; None where it has no time."""
    to_s: float | None
    """When that is at the latest, process time [s]."""
    title: str
    """It in a few words, to stand behind a time where there is one."""
    text: str
    """What follows, in sentences; empty where there is nothing more to say."""


@dataclass(frozen=True, slots=True)
class Outlook:
    """What comes next."""

    level: str
    """How abnormal it is: ``normal``, ``low``, ``medium``, ``high`` or ``critical``."""
    left: TimeLeft
    """How long is left."""
    waiting: str
    """What is waited for, and who must do something for it."""


def outlook(now: Situation, at_s: float, beyond: Collection[str], wrong: bool, plant: PlantDescription) -> Outlook:
    """What comes next at ``at_s`` [s], where the run stands as ``now`` says.

    ``beyond``: names of the limits that the readings violate; ``wrong``: whether an episode lasts.
    """
    hard = {limit.name: limit.description for limit in plant.limits.hard}
    names = [name for name in beyond if name in hard and name not in now.lifted]
    said = _Said(now, at_s, names[0] if names else "", hard.get(names[0], "") if names else "", wrong, plant)
    left = said.left()
    return Outlook(said.level(left), left, said.waiting(left))


def changes_s(now: Situation, plant: PlantDescription) -> Iterator[float]:
    """When, but for events and readings, the line above is said in other words than before [s]."""
    told = now.outlook
    if told is not None:
        yield told.from_s + told.length_s
        if told.first is not None:
            yield from (told.from_s + s for s in (told.first.earliest_s, told.first.middle_s, told.first.latest_s))
    if now.thinking_s is not None:
        yield now.thinking_s + _THINKS_S
    if now.probe_s is not None:
        yield now.probe_s
    if now.waits is not None:
        yield now.waits[1]
    if now.requested_s is not None:
        yield now.requested_s + person_s(plant)
    if now.act_by_s is not None:
        yield now.act_by_s


def requested(now: Situation, at_s: float, plant: PlantDescription) -> str:
    """The mode that was asked for, as long as it is waited for at ``at_s`` [s]; the mode in force where none is."""
    over = now.requested_s is not None and at_s > now.requested_s + person_s(plant)
    return now.mode if over else now.requested


def person_s(plant: PlantDescription) -> float:
    """How long what a person has said counts, or is waited for, where nothing else is told [s]."""
    return GuardSettings().for_ticks(plant.timing.tick_s).person_s


def acts_alone(now: Situation) -> bool:
    """Whether anything at all is written without a person's hands on the plant."""
    return now.mode not in (Mode.OBSERVE, Mode.ADVISE)


@dataclass(frozen=True, slots=True)
class _Said:
    """What is said at one moment."""

    now: Situation
    at_s: float
    beyond: str
    protects: str
    wrong: bool
    plant: PlantDescription

    def left(self) -> TimeLeft:
        """How long is left; what comes first counts, and what is said without a time only where nothing has one."""
        now = self.now
        if now.finished:
            return TimeLeft(Until.ENDED, None, None, "the run has ended", "")
        by_s = now.act_by_s if acts_alone(now) and now.armed else None
        unless = f"unless {'a person decides' if now.mode == Mode.APPROVE else 'something is released'} before"
        if self.beyond:
            what = f"beyond a hard limit: {self.protects or self.beyond}"
            when = f"A reading was beyond it within the last {held_s(self.plant):g} s."
            latest = "" if by_s is None or now.latched or now.lease_lost else f"It acts at {by_s:.0f} s, {unless}."
            said = when, self._answer("If it stays so,"), latest
            return TimeLeft(Until.BEYOND, None, None, what, " ".join(filter(None, said)))
        if now.latched:
            acted = "the plant is latched" if now.done is None else f"{self._done()} at {now.done[1]:.0f} s"
            return TimeLeft(Until.ACTED, None, None, acted, "")
        foreseen = self._foreseen()
        if by_s is not None and (foreseen.from_s is None or by_s <= foreseen.from_s or foreseen.until is Until.PASSED):
            text = f"Then fallback ‘{now.armed[0]}’ acts, at {by_s:.0f} s, {unless}."
            return TimeLeft(Until.FALLBACK, by_s, by_s, f"until fallback ‘{now.armed[0]}’ acts", text)
        return foreseen

    def _foreseen(self) -> TimeLeft:
        """What the twin says, where that is about what is to come."""
        told, at_s = self.now.outlook, self.at_s
        if told is None:
            if not self.wrong:
                return TimeLeft(Until.NOTHING, None, None, "no deadline", "")
            text = "" if self.now.done is None else f"The twin has not looked ahead since {self._done()}."
            return TimeLeft(Until.UNKNOWN, None, None, "not known", text or "The twin has not looked ahead yet.")
        if not told.members:
            return TimeLeft(Until.UNKNOWN, None, None, "not known", f"The twin cannot say what follows: {told.note}.")
        ends_s = told.from_s + told.length_s
        if told.first is None:
            if at_s <= ends_s:
                return TimeLeft(Until.CLEAR, None, None, "no limit foreseen", self._clear(told))
            if not self.wrong:
                return TimeLeft(Until.NOTHING, None, None, "no deadline", "")
            text = f"The twin has looked ahead to {ends_s:.0f} s, and not since."
            return TimeLeft(Until.UNKNOWN, None, None, "not known", text)
        what = first_limit(told, self.plant)
        from_s, to_s = told.from_s + told.first.earliest_s, told.from_s + told.first.latest_s
        if at_s > to_s:
            text = f"It was foreseen at {told.from_s:.0f} s, and the twin has not looked ahead since."
            return TimeLeft(Until.PASSED, from_s, to_s, f"a hard limit was to be reached by {to_s:.0f} s: {what}", text)
        return TimeLeft(Until.LIMIT, from_s, to_s, f"until hard limit ‘{what}’ is broken", self._answer("At the limit"))

    def _clear(self, told: Foreseen) -> str:
        """What is kept, where that is about what was released; of what happens without it the card speaks."""
        if not told.digest:
            return ""
        return f"With what was released no member reaches one by {told.from_s + told.length_s:.0f} s."

    def _answer(self, when: str) -> str:
        """Who answers a hard limit."""
        now = self.now
        if not acts_alone(now):
            return f"In mode ‘{now.mode}’ nothing acts by itself: a person at the plant must."
        if now.lease_lost:
            return "The plant takes no commands: a person at the plant must act."
        if now.latched:
            return f"{self._done().capitalize()}." if now.done is not None else ""
        return f"{when} fallback ‘{now.armed[0]}’ acts." if now.armed else f"{when} a fallback acts."

    def _done(self) -> str:
        what = "" if self.now.done is None else self.now.done[0]
        return "the release" if what == "release" else f"fallback ‘{what}’ acted"

    def level(self, left: TimeLeft) -> str:
        """How abnormal it is: the most urgent of what is foreseen, of the alarms, and of the episode."""
        now, told = self.now, self.now.outlook
        found = [alarm.priority for alarm, _, _ in now.alarms.values() if alarm.alarm not in now.shelved]
        if self.wrong:
            found.append(Priority.MEDIUM)
        if left.until in (Until.FALLBACK, Until.LIMIT, Until.PASSED):
            found.append(Priority.HIGH)
        if left.until is Until.UNKNOWN and told is not None and not told.members:
            found.append(Priority.HIGH)
        if self.beyond:
            found.append(Priority.CRITICAL if self.wrong else Priority.HIGH)
        acted = self.wrong and now.done is not None and now.done[0] != "release"
        if now.latched or acted or _is_due(told, self.at_s):
            found.append(Priority.CRITICAL)
        return max(found, key=_ORDER.index).value if found else NOTHING

    def waiting(self, left: TimeLeft) -> str:
        """What happens next, and who has to do something for it."""
        if self.now.finished:
            return "nothing: the run has ended"
        if self.now.latched:
            return "a person: reset the latch"
        return self._person(left) or self._guard(left) or self._recovery() or self._plant(left)

    def _person(self, left: TimeLeft) -> str:
        """What only a person can do now; empty for nothing."""
        now = self.now
        critical = any(alarm.priority is Priority.CRITICAL for alarm, _, _ in now.alarms.values())
        urgent = critical or bool(self.beyond) or _is_due(now.outlook, self.at_s)
        if not acts_alone(now):
            if urgent:
                return f"a person at the plant: in mode {now.mode!r} nothing is written"
            if now.advised:
                return f"a person at the plant: in mode {now.mode!r} what is advised is not written"
            return ""
        if now.lease_lost and (urgent or left.until in (Until.LIMIT, Until.FALLBACK)):
            return "a person at the plant: it takes no commands"
        if now.offered:
            return "a person: approve or reject the proposal"
        if now.mode == Mode.APPROVE and "fallback wanted" in now.alarms and not self.beyond:
            return "a person: have the fallback act, or act at the plant; nothing is proposed"
        return ""

    def _guard(self, left: TimeLeft) -> str:
        """What the guard does next; empty for nothing."""
        now = self.now
        if now.accepted:
            return "the plant: take what is being written"
        if self.beyond and acts_alone(now):
            return "the guard: a fallback acts where the limit stays violated"
        if now.decided:
            follows = {Mode.CLOSED_LOOP.value: "and write it", Mode.APPROVE.value: "and ask a person"}
            return f"the guard: check what was decided, {follows.get(now.mode, 'and advise it')}"
        return ""

    def _recovery(self) -> str:
        """What recovery waits for or works on; empty for nothing."""
        now, at_s = self.now, self.at_s
        if now.waits is not None and at_s < now.waits[1]:
            waited, until_s = now.waits
            return f"{waited.follows} at {until_s:.0f} s: waiting costs less than acting now"
        if now.probe_s is not None and at_s < now.probe_s:
            return f"what the plant shows until {now.probe_s:.0f} s, which tells explanations apart"
        if now.thinking_s is not None and at_s - now.thinking_s <= _THINKS_S:
            return "recovery: it is working on an answer"
        return ""

    def _plant(self, left: TimeLeft) -> str:
        """What is left to be waited for where nobody does anything."""
        now = self.now
        if left.until in (Until.LIMIT, Until.PASSED) and not acts_alone(now):
            return f"a person at the plant: in mode {now.mode!r} nothing is written"
        if left.until is Until.FALLBACK:
            return f"the fallback: {now.armed[0]!r} acts unless something better is found"
        if left.until in (Until.LIMIT, Until.PASSED):
            return "the guard: a fallback acts at the limit"
        if self.wrong and now.done is not None and now.done[0] == "release":
            return "the effect of what was released"
        return "nothing: the plant is watched"


def _is_due(told: Foreseen | None, at_s: float) -> bool:
    """Whether what is expected to be beyond a hard limit by now has not been looked at since."""
    if told is None or told.first is None or told.first.probability < _LIKELY:
        return False
    return told.from_s + told.first.middle_s <= at_s <= told.from_s + told.first.latest_s
