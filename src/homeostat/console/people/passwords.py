"""Passwords: kept as argon2id hashes (RFC 9106), checked a few at a time, because each check takes memory."""

from __future__ import annotations

import threading
from typing import Final

from argon2 import PasswordHasher
from argon2.exceptions import Argon2Error, InvalidHashError

from homeostat.console.people.accounts import AccountsError, folded

SHORTEST: Final = 12
"""Fewest characters (OWASP ASVS 2.1.1); nothing else is asked of a password."""
LONGEST: Final = 128
"""Most characters."""
_HASHER: Final = PasswordHasher()
_AT_ONCE: Final = threading.BoundedSemaphore(2)
_NOBODYS: Final = _HASHER.hash("a password that nobody has")


def hashed(password: str, name: str) -> str:
    """The hash of ``password``, which ``name`` is to have; AccountsError where it is guessed first."""
    if not SHORTEST <= len(password) <= LONGEST:
        raise AccountsError(f"a password has {SHORTEST} to {LONGEST} characters; this one has {len(password)}")
    plain = folded(password)
    if len(set(plain)) < 4 or folded(name) * (len(plain) // max(1, len(folded(name)))) == plain:
        raise AccountsError("a password that repeats the name, or a few characters, is guessed first; choose another")
    return _HASHER.hash(password)


def is_right(password: str, argon2id: str | None) -> bool:
    """Whether ``password`` has the hash ``argon2id``; where there is none it takes as long, and is not."""
    if len(password) > LONGEST:
        return False
    with _AT_ONCE:
        try:
            right = _HASHER.verify(_NOBODYS if argon2id is None else argon2id, password)
        except (Argon2Error, InvalidHashError):
            return False
    return right and argon2id is not None
