"""Sessions that the server keeps: a cookie names one and says nothing of it, so that it can be ended here."""

from __future__ import annotations

import hashlib
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, final

from homeostat.console.people.accounts import Person

IDLE_S: Final = 1800.0
"""A session that nobody uses for so long ends, wall-clock [s]; a page that is open uses it."""
LONGEST_S: Final = 12 * 3600.0
"""A session lasts for one shift at most, wall-clock [s]."""
MOST: Final = 500
"""Most sessions; the one that was used longest ago goes first."""


@dataclass(slots=True)
class Session:
    """One browser that somebody has signed in from."""

    person: Person
    """Who, as they were known then."""
    csrf: str
    """What a page must show with every order: other pages do not know it."""
    begun: float
    """Since when, by the clock of the sessions [s]."""
    used: float
    """When it was used last [s]."""


@final
class Sessions:
    """All sessions, in memory: they end with the server."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Nobody has signed in; ``clock`` tells seconds and is set by nobody."""
        self._clock = clock
        self._open: dict[str, Session] = {}

    def begin(self, person: Person) -> tuple[str, Session]:
        """A new session of ``person``, after the token that names it."""
        token, now = secrets.token_urlsafe(32), self._clock()
        while len(self._open) >= MOST:
            self._open.pop(min(self._open, key=lambda name: self._open[name].used))
        self._open[_name(token)] = session = Session(person, secrets.token_urlsafe(32), now, now)
        return token, session

    def of(self, token: str) -> Session | None:
        """The session that ``token`` names, which is used by that; None where there is none any more."""
        name, now = _name(token), self._clock()
        session = self._open.get(name)
        if session is None:
            return None
        if now - session.used > IDLE_S or now - session.begun > LONGEST_S:
            del self._open[name]
            return None
        session.used = now
        return session

    def showing(self, csrf: str) -> Session | None:
        """The session whose page shows ``csrf``, which is not used by that; None where there is none any more."""
        now = self._clock()
        found = next((s for s in self._open.values() if secrets.compare_digest(s.csrf, csrf)), None)
        over = found is None or now - found.used > IDLE_S or now - found.begun > LONGEST_S
        return None if over else found

    def end(self, token: str) -> None:
        """The session that ``token`` names is over."""
        self._open.pop(_name(token), None)


def _name(token: str) -> str:
    """What a session is kept by: whoever reads the memory of the server cannot sign in with it."""
    return hashlib.sha256(token.encode()).hexdigest()
