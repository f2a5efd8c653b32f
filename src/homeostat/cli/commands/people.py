"""``homeostat people``: who may look at a console, and order on it."""

import argparse
import getpass
import sys
from collections.abc import Mapping

from homeostat.cli.arguments import UsageError
from homeostat.console.people.accounts import Access, Account, Accounts, AccountsError, added, check_name, removed
from homeostat.domain.quotation import printable


def add(options: argparse.Namespace) -> int:
    """Give a person an account, or another role and password: 0."""
    try:
        from homeostat.console.people.passwords import hashed
    except ImportError as error:
        raise UsageError(f"accounts need {error.name!r}: pip install 'homeostat[console]'") from error
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
    for account in sorted(_known(options).values(), key=lambda account: account.name.casefold()):
        print(printable(f"{account.access.value:<9} {account.name}"))
    return 0


def _known(options: argparse.Namespace) -> Mapping[str, Account]:
    try:
        return Accounts(options.people).all()
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
