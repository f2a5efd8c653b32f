"""``homeostat people``: who may look at a console, and order on it."""

import argparse
import getpass
import sys
from collections.abc import Iterator

from homeostat.cli.arguments import UsageError
from homeostat.console.people.accounts import Access, Account, Accounts, AccountsError, Asked, Known, check_name, folded
from homeostat.console.people.changes import added, enrolled, removed, required
from homeostat.domain.quotation import printable


def add(options: argparse.Namespace) -> int:
    """Give a person an account, or another role and password: 0."""
    try:
        from homeostat.console.people.passwords import hashed
    except ImportError as error:
        raise _missing(error) from error
    try:
        name = check_name(options.name)
        account = Account(name=name, access=Access(options.role), argon2id=hashed(_password(options), name))
        replaced = added(options.people, account)
    except AccountsError as error:
        raise UsageError(str(error)) from error
    print(printable(f"{name}, {options.role}: {'changed' if replaced else 'added'}"))
    return 0


def remove(options: argparse.Namespace) -> int:
    """Take a person's account away: 0."""
    try:
        removed(options.people, options.name)
    except AccountsError as error:
        raise UsageError(str(error)) from error
    print(printable(f"{options.name}: removed"))
    return 0


def listed(options: argparse.Namespace) -> int:
    """List who has an account: 0."""
    known = _known(options)
    for account in sorted(known.people.values(), key=lambda account: account.name.casefold()):
        factor = ", with a second factor" if account.totp else ", may not sign in" if known.lacks(account) else ""
        print(printable(f"{account.access.value:<9} {account.name}{factor}"))
    return 0


def enrol(options: argparse.Namespace) -> int:
    """Give a person a second factor, once their authenticator shows the right code: 0."""
    try:
        import segno

        from homeostat.console.people.codes import Codes, CodesError, address, fresh
    except ImportError as error:
        raise _missing(error) from error
    account = _known(options).people.get(folded(options.name))
    if account is None:
        raise UsageError(f"{str(options.people)!r} has no account of {options.name!r}; 'people add' makes it")
    secret = fresh()
    read = address(secret, account.name, options.title)
    segno.make(read, error="m").terminal(compact=True)
    print(printable(read))
    print(f"by hand: {' '.join(secret[k : k + 4] for k in range(0, len(secret), 4))}")
    codes, asked = Codes(options.people), account.model_copy(update={"totp": secret})
    try:
        codes.check()
        if not any(codes.accept(asked, code) for code in _codes_given()):
            raise UsageError("that is not the code; nothing was changed. Is the clock of both right?")
        enrolled(options.people, account.name, secret)
    except (AccountsError, CodesError) as error:
        raise UsageError(str(error)) from error
    print(printable(f"{account.name}: enrolled"))
    return 0


def unenrol(options: argparse.Namespace) -> int:
    """Take a person's second factor away, as where it was lost: 0."""
    try:
        enrolled(options.people, options.name, None)
    except AccountsError as error:
        raise UsageError(str(error)) from error
    print(printable(f"{options.name}: has no second factor any more"))
    return 0


def require(options: argparse.Namespace) -> int:
    """Say who must have a second factor: 0."""
    try:
        required(options.people, Asked(options.of))
    except AccountsError as error:
        raise UsageError(str(error)) from error
    known = _known(options)
    out = sorted(account.name for account in known.people.values() if known.lacks(account))
    whom = "whoever may order" if options.of == Asked.ORDERING else options.of
    print(printable(f"a second factor is asked of {whom}{'; not yet enrolled: ' if out else ''}{', '.join(out)}"))
    return 0


def _codes_given() -> Iterator[str]:
    """What is typed, three times at most."""
    for _ in range(3):
        print("code that it shows: ", end="", flush=True)
        line = sys.stdin.readline()
        if not line:
            return
        yield line


def _missing(error: ImportError) -> UsageError:
    return UsageError(f"accounts need {error.name!r}: pip install 'homeostat[console]'")


def _known(options: argparse.Namespace) -> Known:
    try:
        return Accounts(options.people).known()
    except AccountsError as error:
        raise UsageError(str(error)) from error


def _password(options: argparse.Namespace) -> str:
    if options.password_stdin:
        return sys.stdin.readline().rstrip("\n")
    if not sys.stdin.isatty():
        raise UsageError("a password is asked for at a terminal; --password-stdin reads it from standard input")
    first = getpass.getpass("password: ")
    if getpass.getpass("again: ") != first:
        raise UsageError("the two are not the same")
    return first
