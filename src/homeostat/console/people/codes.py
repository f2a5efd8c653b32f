"""One-time codes from something that a person has: made from a kept secret and the time (RFC 6238), each taken once."""

from __future__ import annotations

import hashlib
import hmac
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, final

import pyotp

from homeostat.console.people.accounts import Account, folded
from homeostat.console.people.owned import NotOwned, changing, mapping, replace
from homeostat.console.people.tries import Tries

STEP_S: Final = 30
"""How long a code is shown, wall-clock [s]."""
DRIFT: Final = 1
"""Steps by which the two clocks may differ [1]."""
LONGEST_S: Final = 300.0
"""Longest wait after wrong codes, wall-clock [s]. Who guesses at codes knows the password: at one guess in so long,
with three codes of a million that are right, one in a thousand finds one within a day."""
FORGOTTEN_S: Final = 86_400.0
"""Wrong codes before this are forgotten, wall-clock [s]."""
_KEPT_STEPS: Final = 86_400 // STEP_S


class CodesError(ValueError):
    """Which codes were used cannot be known or kept; one line with the remedy."""


def fresh() -> str:
    """A secret to make codes from: 160 random bits in base 32."""
    return str(pyotp.random_base32())


def address(secret: str, name: str, title: str) -> str:
    """What an authenticator reads, as an address: ``secret`` of ``name``, shown under ``title``."""
    return str(pyotp.TOTP(secret, interval=STEP_S).provisioning_uri(name=name, issuer_name=title))


@final
class Codes:
    """Takes codes, and remembers beside the accounts which were used: they stay used when the console begins again."""

    def __init__(self, accounts: Path, clock: Callable[[], float] = time.time) -> None:
        """``accounts`` is the file of accounts; ``clock`` tells seconds since 1970, as authenticators count them."""
        self._path, self._clock = accounts.with_name(f"{accounts.name}.codes"), clock
        self._tries = Tries(time.monotonic, LONGEST_S, FORGOTTEN_S)

    def check(self) -> None:
        """CodesError where it could not be kept which codes were used."""
        if not os.access(self._path.parent, os.W_OK):
            raise CodesError(f"{str(self._path.parent)!r} must be writable: it is kept there which codes were used")
        self._used()

    def wait_s(self, account: Account) -> float:
        """How long the next try of ``account`` must wait after wrong codes, wall-clock [s]; 0 where it need not."""
        return self._tries.wait_s(_guessed(account))

    def accept(self, account: Account, code: str) -> bool:
        """Whether ``code`` is one of ``account`` now that was not used yet; it is used by that.

        CodesError where it cannot be kept that it was.
        """
        if account.totp is None:
            return False
        who, digits = _guessed(account), "".join(code.split())
        self._tries.failed(who)
        made, now = pyotp.TOTP(account.totp, interval=STEP_S), int(self._clock() // STEP_S)
        steps = (now, *(now + sign * k for k in range(1, DRIFT + 1) for sign in (-1, 1)))
        found = [step for step in steps if hmac.compare_digest(made.generate_otp(step).encode(), digits.encode())]
        if not found or not self._take(_name(account), found[0], now):
            return False
        self._tries.succeeded(who)
        return True

    def _take(self, name: str, step: int, now: int) -> bool:
        """Use the code of ``step``; False where that one, or a later one, was used."""
        try:
            with changing(self._path):
                used = self._used()
                if step <= used.get(name, -1):
                    return False
                recent = {other: last for other, last in used.items() if last > now - _KEPT_STEPS}
                replace(self._path, json.dumps({**recent, name: step}).encode())
                return True
        except OSError as error:
            raise CodesError(f"{str(self._path)!r} cannot be written: {error.strerror}") from error

    def _used(self) -> dict[str, int]:
        try:
            return mapping(self._path, int, "which codes were used; remove it")
        except NotOwned as error:
            raise CodesError(str(error)) from error


def _name(account: Account) -> str:
    """What the last code of ``account`` is kept by; another secret begins anew, and nothing of it can be read here."""
    return hashlib.sha256(f"{folded(account.name)} {account.totp}".encode()).hexdigest()[:32]


def _guessed(account: Account) -> str:
    """Whose codes are guessed at: another password ends that."""
    return f"{folded(account.name)} {account.argon2id}"
