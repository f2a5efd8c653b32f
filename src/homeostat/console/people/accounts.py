"""The accounts of a console: one small file of names, roles and argon2id hashes, for its owner alone."""

from __future__ import annotations

import fcntl
import os
import stat
import unicodedata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Final, Literal, final

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from homeostat.domain.mode import Role
from homeostat.domain.quotation import is_unseen

LARGEST: Final = 1_000_000
"""Most bytes of the file."""
LONGEST_NAME: Final = 60
"""Most characters of a name."""


class AccountsError(ValueError):
    """The accounts cannot be used as they are; one line with the remedy."""


class Access(StrEnum):
    """What a person may do on the page, each more than the one before."""

    VIEWER = "viewer"
    """Looks."""
    OPERATOR = "operator"
    """Also approves, rejects, acknowledges, takes tags in and out of service, has the fallback act."""
    ENGINEER = "engineer"
    """Also changes the mode, resets a latch and orders a start."""

    @property
    def role(self) -> Role | None:
        """The role in which the guard hears such a person; None for who only looks."""
        return None if self is Access.VIEWER else Role(self.value)


class Account(BaseModel):
    """One person."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    name: str = Field(min_length=1, max_length=LONGEST_NAME)
    access: Access = Field(strict=False)
    argon2id: str = Field(pattern=r"^\$argon2id\$", max_length=300)


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    schema_: Literal[1] = Field(alias="schema")
    people: list[Account]


@final
class Accounts:
    """The accounts in one file, as they are now: a change counts at once, also for who has signed in before."""

    def __init__(self, path: Path) -> None:
        """``path``: the file; AccountsError where it cannot be used."""
        self._path = path
        self._seen: tuple[int, int, int] | None = None
        self._known: Mapping[str, Account] = {}
        self.all()

    def all(self) -> Mapping[str, Account]:
        """Name, folded -> account; AccountsError where the file is not for its owner alone, or says nothing usable."""
        try:
            descriptor = os.open(self._path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        except OSError as error:
            raise AccountsError(
                f"{str(self._path)!r} cannot be used: {error.strerror}; 'homeostat people add' makes it"
            ) from error
        with os.fdopen(descriptor, "rb") as file:
            found = os.fstat(file.fileno())
            if not stat.S_ISREG(found.st_mode) or found.st_mode & 0o077 or found.st_uid not in (os.getuid(), 0):
                raise AccountsError(f"{str(self._path)!r} must be a file that its owner alone can use: chmod 600")
            seen = found.st_ino, found.st_mtime_ns, found.st_size
            if seen != self._seen:
                self._known = _parsed(file.read(LARGEST + 1), self._path)
                self._seen = seen
        return self._known

    def of(self, name: str) -> Account | None:
        """The account of ``name``, whatever its capitals; None where there is none."""
        return self.all().get(folded(name))


def added(path: Path, account: Account) -> bool:
    """Put ``account`` into the file at ``path``, which is made where there is none; whether it replaced one.

    AccountsError where the file cannot be used.
    """
    with _changing(path):
        known = dict(Accounts(path).all()) if path.exists() else {}
        replaced = folded(account.name) in known
        known[folded(account.name)] = account
        _write(path, known)
    return replaced


def removed(path: Path, name: str) -> None:
    """Take the account of ``name`` out of the file at ``path``; AccountsError where it has none."""
    with _changing(path):
        known = dict(Accounts(path).all())
        if known.pop(folded(name), None) is None:
            have = ", ".join(sorted(account.name for account in known.values())) or "nobody"
            raise AccountsError(f"{str(path)!r} has no account of {name!r}; it has {have}")
        _write(path, known)


def folded(name: str) -> str:
    """One spelling for what people see as the same name."""
    return "".join(unicodedata.normalize("NFKC", name).casefold().split())


def check_name(name: str) -> str:
    """``name`` without blanks around it; AccountsError where it cannot be a person's."""
    trimmed = " ".join(name.split())
    if not 0 < len(trimmed) <= LONGEST_NAME or any(is_unseen(c) or unicodedata.category(c)[0] == "C" for c in trimmed):
        raise AccountsError(f"{name!r} is no name: it has 1 to {LONGEST_NAME} characters, all of them to be seen")
    return trimmed


def _parsed(content: bytes, path: Path) -> Mapping[str, Account]:
    if len(content) > LARGEST:
        raise AccountsError(f"{str(path)!r} has more than {LARGEST} byte; it is no file of accounts")
    try:
        people = _File.model_validate_json(content).people
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise AccountsError(f"{str(path)!r} is no file of accounts: {place}: {first['msg']}") from None
    known = {folded(account.name): account for account in people}
    if len(known) < len(people):
        raise AccountsError(f"{str(path)!r} has two accounts of one name; remove one")
    return known


@contextmanager
def _changing(path: Path) -> Iterator[None]:
    """Nobody else changes the accounts meanwhile."""
    descriptor = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _write(path: Path, known: Mapping[str, Account]) -> None:
    content = _File(schema=1, people=list(known.values())).model_dump_json(by_alias=True, indent=1).encode() + b"\n"
    fresh = path.with_name(f".{path.name}.{os.getpid()}.partial")
    descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    finally:
        fresh.unlink(missing_ok=True)
