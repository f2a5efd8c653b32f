"""The accounts of a console: one small file of names, roles and argon2id hashes, for its owner alone."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final, Literal, final

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from homeostat.console.people.owned import NotOwned, reading
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


class Asked(StrEnum):
    """Who must have a second factor to sign in; whoever has one always needs it."""

    NOBODY = "nobody"
    """Who was not enrolled signs in with the password alone."""
    ORDERING = "ordering"
    """Whoever may order."""
    EVERYBODY = "everybody"
    """Viewers, too."""


class Person(BaseModel):
    """Somebody who may look, and perhaps order."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    name: str = Field(min_length=1, max_length=LONGEST_NAME)
    access: Access = Field(strict=False)


class Account(Person):
    """A person whom the file knows."""

    argon2id: str = Field(pattern=r"^\$argon2id\$", max_length=300)
    totp: str | None = Field(default=None, pattern=r"^[A-Z2-7]{32,128}$")
    """What a second factor's codes are made from, in base 32; None for nobody's."""


class AccountsFile(BaseModel):
    """What the file says."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    schema_: Literal[1] = Field(alias="schema")
    people: list[Account]
    second_factor: Asked = Field(default=Asked.NOBODY, strict=False)


@dataclass(frozen=True, slots=True)
class Known:
    """Everybody, and what is asked of them."""

    people: Mapping[str, Account]
    """Name, folded -> account."""
    asked: Asked
    """Who must have a second factor."""

    def lacks(self, account: Account) -> bool:
        """Whether ``account`` must have a second factor, and has none."""
        needed = self.asked is Asked.EVERYBODY or (self.asked is Asked.ORDERING and account.access.role is not None)
        return needed and account.totp is None


@final
class Accounts:
    """The accounts in one file, as they are now: a change counts at once, also for who has signed in before."""

    def __init__(self, path: Path) -> None:
        """``path``: the file; AccountsError where it cannot be used."""
        self.path: Final = path
        """The file."""
        self._read: tuple[tuple[int, int, int], Known] | None = None
        self.known()

    def known(self) -> Known:
        """What the file says; AccountsError where it is not for its owner alone, or says nothing usable."""
        try:
            with reading(self.path) as file:
                found = os.fstat(file.fileno())
                seen, read = (found.st_ino, found.st_mtime_ns, found.st_size), self._read
                if read is None or read[0] != seen:  # both at once: several threads ask
                    read = self._read = seen, _parsed(file.read(LARGEST + 1), self.path)
        except NotOwned as error:
            raise AccountsError(str(error)) from error
        except OSError as error:
            raise AccountsError(
                f"{str(self.path)!r} cannot be used: {error.strerror}; 'homeostat people add' makes it"
            ) from error
        return read[1]

    def all(self) -> Mapping[str, Account]:
        """Name, folded -> account; AccountsError as :meth:`known`."""
        return self.known().people

    def of(self, name: str) -> Account | None:
        """The account of ``name``, whatever its capitals; None where there is none."""
        return self.all().get(folded(name))


def folded(name: str) -> str:
    """One spelling for what people see as the same name."""
    return "".join(unicodedata.normalize("NFKC", name).casefold().split())


def check_name(name: str) -> str:
    """``name`` without blanks around it; AccountsError where it cannot be a person's."""
    trimmed = " ".join(name.split())
    if not 0 < len(trimmed) <= LONGEST_NAME or any(is_unseen(c) or unicodedata.category(c)[0] == "C" for c in trimmed):
        raise AccountsError(f"{name!r} is no name: it has 1 to {LONGEST_NAME} characters, all of them to be seen")
    return trimmed


def _parsed(content: bytes, path: Path) -> Known:
    if len(content) > LARGEST:
        raise AccountsError(f"{str(path)!r} has more than {LARGEST} byte; it is no file of accounts")
    try:
        found = AccountsFile.model_validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        said = f"{place}: {first['msg']}" if place else str(first["msg"])  # what is no JSON is wrong at no place
        raise AccountsError(f"{str(path)!r} is no file of accounts: {said}") from None
    known = {folded(account.name): account for account in found.people}
    if len(known) < len(found.people):
        raise AccountsError(f"{str(path)!r} has two accounts of one name; remove one")
    return Known(known, found.second_factor)
