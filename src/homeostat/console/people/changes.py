"""Changes of a console's accounts: each reads the file, changes it and replaces it while nobody else does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from homeostat.console.people.accounts import Account, Accounts, AccountsError, AccountsFile, Asked, Known, folded
from homeostat.console.people.owned import changing, replace


def added(path: Path, account: Account) -> bool:
    """Put ``account`` into the file at ``path``, which is made where there is none; whether it replaced one.

    Whoever had a second factor has it still: a new password is no way around it. AccountsError where the file
    cannot be used.
    """
    found = list[bool]()

    def put(known: Known) -> Known:
        before = known.people.get(folded(account.name))
        found.append(before is not None)
        kept = account if before is None or account.totp else account.model_copy(update={"totp": before.totp})
        return Known({**known.people, folded(account.name): kept}, known.asked)

    _change(path, put, made=True)
    return found[0]


def removed(path: Path, name: str) -> None:
    """Take the account of ``name`` out of the file at ``path``; AccountsError where it has none."""

    def take(known: Known) -> Known:
        gone = _named(path, known, name)
        return Known({key: account for key, account in known.people.items() if account is not gone}, known.asked)

    _change(path, take)


def enrolled(path: Path, name: str, totp: str | None) -> None:
    """``name`` has the second factor whose codes are made from ``totp``, or none; AccountsError as :func:`removed`."""

    def change(known: Known) -> Known:
        account = _named(path, known, name).model_copy(update={"totp": totp})
        return Known({**known.people, folded(name): account}, known.asked)

    _change(path, change)


def required(path: Path, asked: Asked) -> None:
    """From now on ``asked`` must have a second factor; AccountsError where the file at ``path`` cannot be used."""
    _change(path, lambda known: Known(known.people, asked))


def _named(path: Path, known: Known, name: str) -> Account:
    found = known.people.get(folded(name))
    if found is None:
        have = ", ".join(sorted(account.name for account in known.people.values())) or "nobody"
        raise AccountsError(f"{str(path)!r} has no account of {name!r}; it has {have}")
    return found


def _change(path: Path, change: Callable[[Known], Known], made: bool = False) -> None:
    try:
        with changing(path):
            there = path.exists() or not made
            known = change(Accounts(path).known() if there else Known({}, Asked.NOBODY))
            said = AccountsFile(schema=1, people=list(known.people.values()), second_factor=known.asked)
            content = said.model_dump_json(by_alias=True, exclude_defaults=True, indent=1)
            replace(path, content.encode() + b"\n")
    except OSError as error:
        raise AccountsError(f"{str(path)!r} cannot be written: {error.strerror}") from error
