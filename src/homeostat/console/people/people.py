"""Who is at the page: signed in once, and asked for the password again before anything that matters is ordered."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Final, final

from homeostat.console.people.accounts import Account, Accounts, AccountsError, Known, Person, folded
from homeostat.console.people.codes import Codes, CodesError
from homeostat.console.people.guesses import Guess, Guesses
from homeostat.console.people.passwords import is_right
from homeostat.console.people.sessions import Session, Sessions
from homeostat.domain.quotation import printable

WRONG: Final = "name and password do not belong together"
"""What is said of every failed sign-in, whoever has an account."""
WRONG_WITH_CODES: Final = "name, password and code (of who has one) do not belong together"
"""The same where some have a second factor, of everybody."""


class Unproven(Exception):
    """Somebody has not shown who they are; one line says what to do."""

    def __init__(self, text: str, wait_s: float = 0.0) -> None:
        super().__init__(text)
        self.wait_s = wait_s
        """How long to wait before the next try [s]."""


def tell(text: str) -> None:
    """Say ``text`` where the console was started, as far as anything can be said there."""
    with contextlib.suppress(OSError, ValueError):  # a terminal that has gone, or a full disk, keeps nobody out
        print(f"homeostat: {printable(text)}", file=sys.stderr, flush=True)


@final
class People:
    """Everybody who may use one console."""

    def __init__(
        self,
        accounts: Accounts,
        sessions: Sessions | None = None,
        guesses: Guesses | None = None,
        log: Callable[[str], None] = tell,
        codes: Codes | None = None,
    ) -> None:
        """``accounts`` of everybody; ``log`` is told who signs in, fails to, or signs out.

        ``codes`` takes second factors' codes; it is made from ``accounts`` where there is none. CodesError where it
        could not keep which were used, and somebody has one.
        """
        self._accounts, self.log = accounts, log
        self._sessions, self._guesses = sessions or Sessions(), guesses or Guesses()
        self._codes = codes or Codes(accounts.path)
        if self.have_codes:
            self._codes.check()

    @property
    def have_codes(self) -> bool:
        """Whether anybody has a second factor."""
        try:
            return any(account.totp is not None for account in self._accounts.all().values())
        except AccountsError:
            return False

    def sign_in(self, name: str, password: str, address: str, code: str = "") -> tuple[str, Session]:
        """A new session of ``name``, after its token; Unproven where ``password`` is not theirs. It takes a while.

        ``code`` is their second factor's, where they have one.
        """
        account, known = self._proven(Guess(name, address), password, code)
        if known.lacks(account):
            self.log(f"{account.name!r} has no second factor, and must have one to sign in from {address}")
            raise Unproven(f"{account.name!r} needs a second factor to sign in: 'homeostat people enrol' gives it")
        return self.begin(account, f"from {address}")

    def begin(self, person: Person, how: str) -> tuple[str, Session]:
        """A new session of ``person``, who has shown who they are, after its token; ``how`` is logged."""
        self.log(f"{person.name!r} signed in as {person.access.value} {how}")
        return self._sessions.begin(person)

    def showing(self, csrf: str) -> Session | None:
        """The session whose page shows ``csrf``; None where it is over."""
        return self._sessions.showing(csrf)

    def confirm(self, session: Session, password: str, address: str) -> Account:
        """The account of ``session`` as it is now; Unproven where ``password`` is not theirs. It takes a while."""
        return self._proven(Guess(session.person.name, address, signed_in=True), password, None)[0]

    def session(self, token: str | None, use: bool = True) -> Session | None:
        """The session that ``token`` names; None where it is over, or the account was changed since.

        Where it is not in ``use`` by that, it grows old all the same.
        """
        session = None if not token else self._sessions.of(token, use)
        if session is None or token is None:
            return None
        try:
            known, person = self._accounts.known(), session.person
        except AccountsError as error:
            self.log(f"nobody is let in: {error}")
            return None
        found = known.people.get(folded(person.name))
        own = isinstance(person, Account)  # the name of a provider's person may have been given to somebody since
        unchanged = found == person and not known.lacks(person) if own else found is None
        if not unchanged:
            self._sessions.end(token)
        return session if unchanged else None

    def sign_out(self, token: str | None) -> None:
        """The session that ``token`` names is over."""
        session = self.session(token)
        if session is not None and token is not None:
            self._sessions.end(token)
            self.log(f"{session.person.name!r} signed out")

    def _proven(self, guess: Guess, password: str, code: str | None) -> tuple[Account, Known]:
        """Whose account it is, and what is asked of everybody; ``code`` is None where none is asked for."""
        try:
            known = self._accounts.known()
        except AccountsError as error:
            self.log(f"nobody is let in: {error}")
            raise Unproven("the accounts cannot be read; see where the console was started") from error
        account = known.people.get(folded(guess.name))
        guess = replace(guess, known=account is not None)
        needed = account is not None and account.totp is not None and code is not None
        wait_s = self._codes.wait_s(account) if needed and account else 0.0
        taken = None if wait_s > 0.0 else self._guesses.take(guess)
        if taken is None:
            wait_s = max(1.0, wait_s, self._guesses.wait_s(guess))
            raise Unproven(f"too many failed tries; try again in {wait_s:.0f} s", wait_s)
        right = is_right(password, None if account is None else account.argon2id)
        if account is None or not right or (needed and not self._taken(account, code or "", guess.address)):
            what = "an order" if guess.signed_in else "a sign-in"
            self.log(f"{what} as {guess.name[:60]!r} from {guess.address} has failed")
            raise Unproven(WRONG_WITH_CODES if self.have_codes else WRONG)
        self._guesses.succeeded(taken)
        return account, known

    def _taken(self, account: Account, code: str, address: str) -> bool:
        """Whether ``code`` is one that ``account`` has not used yet."""
        try:
            if self._codes.accept(account, code):
                return True
        except CodesError as error:
            self.log(f"nobody who has a second factor is let in: {error}")
            raise Unproven("codes cannot be checked; see where the console was started") from error
        if code:
            self.log(f"{account.name!r} gave the right password and a code that is wrong or was used, from {address}")
        return False
