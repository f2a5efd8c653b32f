"""Authority: who may order what; person, role, four eyes and digest are one check."""

from __future__ import annotations

from homeostat.domain.mode import Mode, PersonCommand, Role, Verb

ENGINEERING = frozenset({Verb.RESET, Verb.MODE, Verb.START})
"""What only an engineer may order."""
NEEDS_REASON = frozenset({Verb.RESET, Verb.REJECT, Verb.OUT_OF_SERVICE, Verb.FALL_BACK})
"""What is ordered with a reason only."""
LONGEST = 500
"""Most characters of a reason or a name."""


class Authority:
    """Judges the orders of people; remembers those that are used and the first of two who must agree."""

    def __init__(self, persons: int) -> None:
        """``persons``: how many people must agree to a reset."""
        self._persons = persons
        self._used: dict[str, None] = {}
        self._agreed: dict[str, str] = {}

    def objection(self, command: PersonCommand) -> str:
        """Why ``command`` may not be carried out whatever the plant is doing; empty where it may."""
        texts = (command.id, command.person, command.subject, command.digest, command.reason)
        if any(len(str(text)) > LONGEST for text in texts):
            return f"an order is made of texts of at most {LONGEST} characters"
        if command.verb not in tuple(Verb) or command.role not in tuple(Role):
            return f"there is no order {command.verb!r} in role {command.role!r}"
        if not command.person.strip():
            return "an order needs the name of a person"
        if command.id in self._used:
            return f"order {command.id!r} was carried out already"
        if command.verb in ENGINEERING and command.role is not Role.ENGINEER:
            return f"only an engineer may order {command.verb.value!r}"
        if command.verb in NEEDS_REASON and not command.reason.strip():
            return f"{command.verb.value!r} needs a reason"
        if command.verb is Verb.MODE and command.subject not in {m.value for m in Mode}:
            return f"there is no mode {command.subject!r}; there are {', '.join(m.value for m in Mode)}"
        return ""

    def use(self, command: PersonCommand) -> None:
        """Take note that ``command`` was answered; it is not carried out again."""
        self._used[command.id] = None
        if len(self._used) > 10_000:
            self._used.pop(next(iter(self._used)))

    def agree(self, command: PersonCommand) -> tuple[str, ...]:
        """Everybody who has agreed to a reset, once they are enough; empty while somebody is missing."""
        self._agreed[command.person.strip().casefold()] = command.person
        if len(self._agreed) < self._persons:
            return ()
        agreed = tuple(self._agreed.values())
        self._agreed.clear()
        return agreed
