"""Who is at the page: signed in once, and asked for the password again before anything that matters is ordered."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Final, final

from homeostat.console.people.accounts import Account, Accounts, AccountsError, folded
from homeostat.console.people.passwords import is_right
from homeostat.console.people.sessions import Session, Sessions
from homeostat.console.people.tries import Tries
from homeostat.domain.quotation import printable

WRONG: Final = "name and password do not belong together"
"""What is said of every failed sign-in, whoever has an account."""


class Unproven(Exception):
    """Somebody has not shown who they are; one line says what to do."""

    def __init__(self, text: str, wait_s: float = 0.0) -> None:
        super().__init__(text)
        self.wait_s = wait_s
        """How long to wait before the next try [s]."""


def tell(text: str) -> None:
    """Say ``text`` where the console was started."""
    print(f"homeostat: {printable(text)}", file=sys.stderr, flush=True)


@final
class People:
    """Everybody who may use one console."""

    def __init__(
        self,
        accounts: Accounts,
        sessions: Sessions | None = None,
        tries: Tries | None = None,
        log: Callable[[str], None] = tell,
    ) -> None:
        """``accounts`` of everybody; ``log`` is told who signs in, fails to, or signs out."""
        self._accounts, self._log = accounts, log
        self._sessions, self._tries = sessions or Sessions(), tries or Tries()

    def sign_in(self, name: str, password: str, address: str) -> tuple[str, Session]:
        """A new session of ``name``, after its token; Unproven where ``password`` is not theirs. It takes a while."""
        account = self._proven(name, password, address)
        self._log(f"{account.name!r} signed in as {account.access.value} from {address}")
        return self._sessions.begin(account)

    def confirm(self, session: Session, password: str, address: str) -> Account:
        """The account of ``session`` as it is now; Unproven where ``password`` is not theirs. It takes a while."""
        return self._proven(session.account.name, password, address)

    def session(self, token: str | None) -> Session | None:
        """The session that ``token`` names; None where it is over, or the account was changed since."""
        session = None if not token else self._sessions.of(token)
        if session is None or token is None:
            return None
        try:
            unchanged = self._accounts.of(session.account.name) == session.account
        except AccountsError as error:
            self._log(f"nobody is let in: {error}")
            return None
        if not unchanged:
            self._sessions.end(token)
        return session if unchanged else None

    def sign_out(self, token: str | None) -> None:
        """The session that ``token`` names is over."""
        session = self.session(token)
        if session is not None and token is not None:
            self._sessions.end(token)
            self._log(f"{session.account.name!r} signed out")

    def _proven(self, name: str, password: str, address: str) -> Account:
        who = f"name {folded(name)}", f"address {address}"
        wait_s = self._tries.wait_s(*who)
        if wait_s > 0.0:
            raise Unproven(f"too many failed tries; try again in {wait_s:.0f} s", wait_s)
        self._tries.failed(*who)  # before the check: many at once are no way around it
        try:
            account = self._accounts.of(name)
        except AccountsError as error:
            self._log(f"nobody is let in: {error}")
            raise Unproven("the accounts cannot be read; see where the console was started") from error
        if not is_right(password, None if account is None else account.argon2id) or account is None:
            self._log(f"a sign-in as {name[:60]!r} from {address} has failed")
            raise Unproven(WRONG)
        self._tries.succeeded(*who)
        return account
