"""Sessions that the server keeps: a cookie names one and says nothing of it, so that it can be ended here."""

from __future__ import annotations

import hashlib
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, final

from homeostat.console.people.accounts import Person, folded

IDLE_S: Final = 1800.0
"""A session that nobody uses for so long ends, wall-clock [s]; a page that is open uses it."""
LONGEST_S: Final = 12 * 3600.0
"""A session lasts for one shift at most, wall-clock [s]."""
MOST: Final = 20
"""Most sessions of one person; of their own the one that was used longest ago goes first, and nobody else's does."""


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
    """All sessions, in memory: they end with the server. They may be asked for from any thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Nobody has signed in; ``clock`` tells seconds and is set by nobody."""
        self._clock = clock
        self._open: dict[str, Session] = {}
        self._alone = threading.Lock()

    def begin(self, person: Person) -> tuple[str, Session]:
        """A new session of ``person``, after the token that names it."""
        token, now = secrets.token_urlsafe(32), self._clock()
        session = Session(person, secrets.token_urlsafe(32), now, now)
        with self._alone:
            for name in [name for name, one in self._open.items() if _is_over(one, now)]:
                del self._open[name]
            own = [name for name, one in self._open.items() if folded(one.person.name) == folded(person.name)]
            own.sort(key=lambda name: self._open[name].used)
            for name in own[: max(0, len(own) + 1 - MOST)]:
                del self._open[name]
            self._open[_name(token)] = session
        return token, session

    def of(self, token: str, use: bool = True) -> Session | None:
        """The session that ``token`` names, which is in ``use`` by that; None where there is none any more."""
        name, now = _name(token), self._clock()
        with self._alone:
            session = self._open.get(name)
            if session is None:
                return None
            if _is_over(session, now):
                del self._open[name]
                return None
            session.used = now if use else session.used
            return session

    def showing(self, csrf: str) -> Session | None:
        """The session whose page shows ``csrf``, which is not used by that; None where there is none any more."""
        now = self._clock()
        with self._alone:
            every = list(self._open.values())
        found = next((s for s in every if secrets.compare_digest(s.csrf.encode(), csrf.encode(errors="replace"))), None)
        return None if found is None or _is_over(found, now) else found

    def end(self, token: str) -> None:
        """The session that ``token`` names is over."""
        with self._alone:
            self._open.pop(_name(token), None)


def _is_over(session: Session, now: float) -> bool:
    return now - session.used > IDLE_S or now - session.begun > LONGEST_S


def _name(token: str) -> str:
    """What a session is kept by: whoever reads the memory of the server cannot sign in with it."""
    return hashlib.sha256(token.encode()).hexdigest()
