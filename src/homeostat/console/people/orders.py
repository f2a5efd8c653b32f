"""An order from the page: what it may say, who may give it, and what must still be so that it is passed on."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, final

from pydantic import BaseModel, ConfigDict, Field

from homeostat.console.opened import OpenedRun
from homeostat.console.people.accounts import Person
from homeostat.domain.events.people import PersonHeard
from homeostat.domain.mode import PersonCommand, Verb
from homeostat.guard.texts import LONGEST_NAME, brief

Give = Callable[[PersonCommand], "Came"]
"""Gives an order to the guard and waits for its answer; NotGiven where there is none."""
PROVEN: Final = frozenset(Verb) - {Verb.ACKNOWLEDGE, Verb.SHELVE, Verb.UNSHELVE, Verb.NOTE}
"""What is ordered with the password again."""
_TEXT: Final = 500
_REMEMBERED: Final = 1000
_ANOTHER: Final = "the identifier is of another order, which was answered already; look at the journal, and order anew"


class NotGiven(Exception):
    """An order was not given, or nobody knows what came of it; one line says which."""


@dataclass(frozen=True, slots=True)
class Came:
    """What came of an order."""

    done: bool
    """Whether it was carried out."""
    reason: str
    """Why not, who else must order it, or the person's own reason."""
    counts: bool
    """Whether it counts though it was not carried out: more people must order it."""


class Ordered(BaseModel):
    """An order as the page sends it."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    id: str = Field(pattern=r"^[0-9A-Za-z-]{8,64}$")
    verb: Verb = Field(strict=False)
    subject: str = Field(default="", max_length=_TEXT)
    digest: str = Field(default="", max_length=_TEXT)
    reason: str = Field(default="", max_length=_TEXT)
    seconds: float = Field(default=0.0, ge=0.0, allow_inf_nan=False, strict=False)
    password: str = Field(default="", max_length=_TEXT)


Fault = Literal["role", "changed", "busy"]


class Objection(Exception):
    """An order is not passed on; one line says why."""

    def __init__(self, fault: Fault, text: str) -> None:
        super().__init__(text)
        self.fault: Fault = fault
        """Whose fault it is: who orders, what has changed meanwhile, or the same order is on its way."""


@final
class Orders:
    """Passes orders on to the guard of one run; what was ordered under an identifier is ordered once."""

    def __init__(self, run: OpenedRun, give: Give) -> None:
        """``give`` takes orders to the guard of ``run``."""
        self._run, self._give = run, give
        self._lock = threading.Lock()
        self._going: set[str] = set()
        self._given: dict[str, str] = {}

    def earlier(self, ordered: Ordered, person: Person) -> Came | None:
        """What came of the order before, where the journal has it: a page that lost the answer asks again.

        Objection where it was another order that had its identifier.
        """
        self._run.refresh()
        for entry in reversed(self._run.entries):
            event = entry.event
            if isinstance(event, PersonHeard) and event.command == ordered.id:
                given = self._given.get(ordered.id)
                if not _is_of(event, ordered, person) or given not in (None, _content(ordered, person)):
                    raise Objection("changed", _ANOTHER)
                return Came(event.done, event.reason, event.missing > 0)
        return None

    def check(self, ordered: Ordered, person: Person) -> None:
        """Objection where ``person`` may not order it, or what was shown is not what waits any more."""
        if person.access.role is None:
            raise Objection("role", f"{person.name!r} is a viewer and orders nothing")
        if ordered.verb is not Verb.APPROVE:
            return
        self._run.refresh()
        fresh = self._run.fresh
        if fresh is not None and fresh.old:
            raise Objection("changed", f"the page is old: {fresh.trouble}; nothing is approved on old data")
        waits = self._run.stands(self._run.last_s).offered.get(ordered.subject)
        if waits is None:
            raise Objection("changed", f"request {ordered.subject!r} does not wait any more; look at it again")
        if not ordered.digest or waits[0].digest != ordered.digest:
            raise Objection("changed", f"what was shown is not what request {ordered.subject!r} is now; look again")

    def give(self, ordered: Ordered, person: Person) -> Came:
        """Pass it on, and wait for the answer; Objection as :meth:`check`, NotGiven where there is no answer."""
        with self._lock:
            if ordered.id in self._going:
                raise Objection("busy", "the order is on its way already; wait for its answer")
            self._going.add(ordered.id)
        try:
            came = self.earlier(ordered, person)
            if came is not None:
                return came
            self.check(ordered, person)
            self._remember(ordered, person)
            role = person.access.role
            assert role is not None
            about = ordered.subject, ordered.digest, ordered.reason
            named = ordered.id, person.name, role, ordered.verb
            return self._give(PersonCommand(*named, *about, seconds=ordered.seconds))
        finally:
            with self._lock:
                self._going.discard(ordered.id)

    def _remember(self, ordered: Ordered, person: Person) -> None:
        """Keep what is ordered: the journal has not all of it, and not the reason where it was refused."""
        with self._lock:
            while len(self._given) >= _REMEMBERED:
                self._given.pop(next(iter(self._given)))
            self._given[ordered.id] = _content(ordered, person)


def _is_of(event: PersonHeard, ordered: Ordered, person: Person) -> bool:
    """Whether ``event`` is of that order, as far as the journal tells: a door adds the login to the name."""
    named = event.person == person.name or event.person.startswith(f"{person.name} (login ")
    if not named or event.verb != ordered.verb.value or event.subject != brief(ordered.subject, LONGEST_NAME):
        return False
    return not event.done or event.reason == brief(ordered.reason)  # else it says why it was not carried out


def _content(ordered: Ordered, person: Person) -> str:
    """What tells two orders apart, in short."""
    said = f"{person.name}\n{ordered.model_dump_json(exclude={'password'})}"
    return hashlib.sha256(said.encode()).hexdigest()
