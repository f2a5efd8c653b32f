"""Authority: who may order what, person, role, four eyes and digest being one check; and other objections."""

import unicodedata
from collections.abc import Iterable

from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.quotation import is_unseen
from homeostat.guard.restart.memory import REMEMBERED
from homeostat.guard.sequence.service import Service
from homeostat.guard.texts import LONGEST, LONGEST_NAME, brief, fits
from homeostat.stl.spelling import near_matches


def no_mode(name: str) -> str:
    """There is no mode called ``name``."""
    known = [mode.value for mode in Mode]
    return f"there is no mode {name!r}{near_matches(name, known)}; there are {', '.join(known)}"


def no_alarm(name: str, standing: Iterable[str]) -> str:
    """No alarm called ``name`` is among the ``standing`` ones."""
    known = tuple(standing)
    return f"there is no alarm {name!r}{near_matches(name, known) if known else '; none stands'}"


def no_request(name: str, offered: Iterable[str]) -> str:
    """No request called ``name`` is among the ``offered`` ones."""
    known = tuple(offered)
    return f"no request {name!r} waits for a person{near_matches(name, known) if known else '; none does'}"


def unchanged_service(tag: str, rules: GuardRules, service: Service) -> str:
    """Why ``tag`` can be neither brought back nor taken out: it is no tag, nobody writes it, or it is so already."""
    if tag not in rules.tags:
        return f"there is no tag {tag!r}{near_matches(tag, rules.writables)}"
    if tag not in rules.writables:
        return f"{tag!r} is not writable: it has no service to be taken out of"
    return f"{tag!r} is {'out of' if tag in service.out else 'in'} service already"


def no_start(name: str, rules: GuardRules, state: str) -> str:
    """Why nobody can order transition ``name`` in ``state``, and what can be ordered there."""
    transitions = rules.machine.transitions
    found = next((t for t in transitions if t.name == name), None)
    if found is None:
        return f"there is no transition {name!r}{near_matches(name, [t.name for t in transitions if t.on_decision])}"
    if found.source == state:
        return f"{name!r} is taken by itself once its guard holds: {str(found.guard)!r}"
    open_ = [t.name for t in transitions if t.source == state and t.on_decision]
    return f"{name!r} does not leave state {state!r}, but {found.source!r}; from here lead {', '.join(open_) or 'none'}"


ENGINEERING = frozenset({Verb.RESET, Verb.MODE, Verb.START})
"""What only an engineer may order."""
NEEDS_REASON = frozenset({Verb.RESET, Verb.REJECT, Verb.OUT_OF_SERVICE, Verb.FALL_BACK, Verb.SHELVE, Verb.NOTE})
"""What is ordered with a reason only."""


class Authority:
    """Judges the orders of people; remembers those that are used and the first of two who must agree."""

    def __init__(self, persons: int, lasts_s: float, oldest_s: float) -> None:
        """``persons``: how many people must agree to a reset and to closed loop, within ``lasts_s`` of each other [s].

        ``oldest_s``: oldest order that is carried out [s]. One that was recorded and is delivered again was answered
        already, or is too old.
        """
        self._persons, self._lasts_s, self._oldest_s = persons, lasts_s, oldest_s
        self._used: dict[str, None] = {}
        self._agreed: dict[Verb, dict[str, tuple[str, float]]] = {}

    def objection(self, command: PersonCommand) -> str:
        """Why ``command`` may not be carried out whatever the plant is doing; empty where it may."""
        malformed = _malformed(command)
        if malformed:
            return malformed
        verb: object = command.verb
        role: object = command.role
        if not (isinstance(verb, Verb) and isinstance(role, Role)):
            return f"there is no order {brief(verb, 40)!r} in role {brief(role, 40)!r}"
        if not (command.id and _folded(command.person)):
            return "an order needs an identifier and the name of a person"
        if command.id in self._used:
            return f"order {command.id!r} was answered already"
        untimely = self._untimely(command.age_s)
        if untimely:
            return untimely
        if command.verb in ENGINEERING and command.role is not Role.ENGINEER:
            return f"only an engineer may order {command.verb.value!r}"
        if command.verb in NEEDS_REASON and not _folded(command.reason):
            return f"{command.verb.value!r} needs a reason"
        if command.verb is Verb.MODE and command.subject not in {m.value for m in Mode}:
            return no_mode(command.subject)
        return ""

    def _untimely(self, age_s: float) -> str:
        """Why an order of this age [s] is not carried out; empty where it is."""
        if type(age_s) not in (int, float):
            return f"the age of an order is a number of seconds, not of type {brief(type(age_s).__name__, 40)!r}"
        if age_s < 0.0:
            return f"the order was issued {-age_s:.6g} s in the future; set the clocks and give it again"
        if age_s <= self._oldest_s:
            return ""
        return f"the order is {age_s:.6g} s old and counts for {self._oldest_s:g} s; give it again"

    def remember(self, used: Iterable[str]) -> None:
        """Orders with these identifiers were answered, and are not carried out any more."""
        self._used.update(dict.fromkeys(used))
        while len(self._used) > REMEMBERED:
            self._used.pop(next(iter(self._used)))

    def missing(self, verb: Verb) -> int:
        """People who must still agree to what was agreed to last."""
        return self._persons - len(self._agreed.get(verb, ()))

    def agree(self, command: PersonCommand, now_s: float) -> tuple[str, ...]:
        """Everybody who has agreed to such an order, once they are enough; empty while somebody is missing.

        A login that types names is one person, whatever it types.
        """
        agreed = self._agreed.setdefault(command.verb, {})
        for key, (_, at_s) in list(agreed.items()):
            if now_s - at_s > self._lasts_s:
                del agreed[key]
        key = f"login {command.login}" if command.login else f"name {_folded(command.person)}"
        agreed[key] = (command.person, now_s)
        if len(agreed) < self._persons:
            return ()
        del self._agreed[command.verb]
        return tuple(person for person, _ in agreed.values())

    def forget(self, verb: Verb) -> None:
        """What was agreed to of such an order so far counts no more."""
        self._agreed.pop(verb, None)


def _malformed(command: PersonCommand) -> str:
    """What of the texts of ``command`` is none, or is too long; empty where nothing is."""
    names: dict[str, object] = {"identifier": command.id, "person": command.person, "subject": command.subject}
    texts: dict[str, object] = {"digest": command.digest, "reason": command.reason}
    for what, given in (names | texts).items():
        if type(given) is not str:
            return f"the {what} of an order is a plain text, not of type {brief(type(given).__name__, 40)!r}"
    if all(fits(n, LONGEST_NAME) for n in names.values()) and all(fits(t, LONGEST) for t in texts.values()):
        return ""
    return f"an order has names of at most {LONGEST_NAME} characters and a reason of at most {LONGEST}"


def _folded(text: str) -> str:
    """One spelling for what people see as the same name; empty where they see nothing."""
    before, folded = "", text
    while folded != before:  # what is not seen may keep a letter and its accent apart
        before, folded = folded, _once("".join(c for c in folded if not (is_unseen(c) or c.isspace())))
    return folded


def _once(text: str) -> str:
    return unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", text).casefold())
