"""Somebody comes back from a provider: who they are, what they may do, and which order they have shown it for."""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, Literal, final

from cryptography.fernet import Fernet, InvalidToken

from homeostat.console.people.accounts import Accounts, AccountsError, Person, check_name
from homeostat.console.people.orders import Ordered
from homeostat.console.people.people import Unproven, tell
from homeostat.console.people.sessions import Session
from homeostat.console.sign_on.names import Names
from homeostat.console.sign_on.provider import Provider, ProviderError, Request
from homeostat.console.sign_on.settings import SignOnError, read_settings

WAITED_S: Final = 600
"""How long somebody may be at the provider, wall-clock [s]."""
PROVEN_S: Final = 120.0
"""How long an order may be given once somebody has shown who they are for it, wall-clock [s]."""
_MOST: Final = 500

Word = Literal["ended", "provider", "role", "name", "other"]


class NotSignedOn(Exception):
    """Somebody has not come in by the provider; the console's own log has the reason, the browser a word."""

    def __init__(self, word: Word, reason: str) -> None:
        super().__init__(reason)
        self.word: Word = word


class Federated(Person):
    """A person whom the provider knows."""

    subject: str
    """Who, as the provider never says of anybody else."""


@dataclass(frozen=True, slots=True)
class About:
    """The order for which somebody shows who they are; empty where they sign in."""

    session: str = ""
    """The token of their session's page."""
    id: str = ""
    verb: str = ""
    subject: str = ""
    digest: str = ""


@final
class SignOn:
    """Single sign-on of one console."""

    def __init__(self, path: Path, accounts: Accounts, log: Callable[[str], None] = tell) -> None:
        """``path`` of the settings; ``accounts`` that the file knows; SignOnError where they cannot be used."""
        self.settings, secret = read_settings(path)
        try:
            self._provider = Provider(self.settings, secret)
        except OSError as error:
            raise SignOnError(f"{str(self.settings.ca)!r} cannot be used: {error}") from error
        self._names, self._accounts, self._log = Names(path), accounts, log
        self._names.known()
        self._sealed = Fernet(Fernet.generate_key())
        self._shown: dict[About, tuple[float, Person]] = {}

    def begin(self, about: About) -> tuple[str, str]:
        """Where a browser is sent, and what it is to keep until it is back; NotSignedOn where there is no provider."""
        state, nonce, verifier = (secrets.token_urlsafe(32) for _ in range(3))
        request = Request(state, nonce, verifier, time.monotonic())
        kept = self._sealed.encrypt(json.dumps([asdict(request), asdict(about)]).encode()).decode()
        try:
            return self._provider.address(request), kept
        except ProviderError as error:
            raise NotSignedOn("provider", str(error)) from error

    def end(self, kept: str, state: str, code: str, issuer: str | None) -> tuple[Person, About]:
        """Who has come back with ``code``, and what for; NotSignedOn where that is not right.

        ``kept`` is what the browser kept; ``state`` and ``issuer`` came with it.
        """
        try:
            asked, about = json.loads(self._sealed.decrypt(kept.encode(), ttl=WAITED_S))
        except InvalidToken:
            raise NotSignedOn("ended", "this browser was not sent to the provider, or is back too late") from None
        request = Request(**asked)
        if not secrets.compare_digest(request.state.encode(), state.encode()):
            raise NotSignedOn("ended", "the answer is to another question")
        if not code:
            raise NotSignedOn("ended", "they did not sign in there")
        try:
            claims = self._provider.claims(request, code, issuer)
        except ProviderError as error:
            raise NotSignedOn("provider", str(error)) from error
        access = self.settings.roles.access(claims)
        if access is None:
            raise NotSignedOn("role", f"{claims['sub']!r} has none of the groups in [roles]")
        person = Federated(name=self._named(claims["sub"], claims.get(self.settings.name_claim)), access=access,
                           subject=claims["sub"])  # fmt: skip
        return person, About(**about)

    def show(self, session: Session, person: Person, about: About) -> None:
        """``person`` has shown who they are for the order ``about``; NotSignedOn where the session is another's."""
        mine = session.person
        if not isinstance(mine, Federated) or not isinstance(person, Federated) or mine.subject != person.subject:
            raise NotSignedOn("other", f"{person.name!r} has shown who they are, at the page of {mine.name!r}")
        session.person = person
        while len(self._shown) >= _MOST:
            self._shown.pop(next(iter(self._shown)))
        self._shown[about] = time.monotonic() + PROVEN_S, person

    def shown(self, about: About) -> Person | None:
        """Who has shown who they are for the order ``about``, as they are now; None for nobody, or where it is late."""
        until, person = self._shown.get(about, (0.0, None))
        return person if time.monotonic() < until else None

    def confirm(self, session: Session, ordered: Ordered) -> Person:
        """The person of ``session``; Unproven where they have not shown for just this order who they are."""
        person = self.shown(about(session, ordered))
        if person is None:
            raise Unproven(f"{self.settings.title} has not been asked who you are for this order, or too long ago")
        return person

    def _named(self, subject: str, name: object) -> str:
        try:
            wanted = check_name(str(name))
            found = self._names.of(subject, wanted) if isinstance(name, str) else None
            if found is None or self._accounts.of(found) is not None:
                raise NotSignedOn("name", f"{wanted!r} is the name of somebody else, or no name ({subject!r})")
        except (AccountsError, SignOnError) as error:
            raise NotSignedOn("name", str(error)) from error
        return found


def about(session: Session, ordered: Ordered) -> About:
    """What somebody shows who they are for, when ``ordered`` is ordered at the page of ``session``."""
    return About(session.csrf, ordered.id, ordered.verb.value, ordered.subject, ordered.digest)
