"""What a person orders of a run that goes on: reject, reset, mode, in-service, acknowledge, and more."""

from __future__ import annotations

import argparse
import getpass
import os
import secrets
from typing import Final

from homeostat.cli.options.arguments import UsageError
from homeostat.cli.run_directory import run_directory
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.domain.quotation import printable
from homeostat.service.answers import Heard, length, wait_for
from homeostat.service.inbox import post, take_back

REFUSED: Final = 3
"""Exit status of an order that the guard refused."""
ANSWER_S: Final = 10.0
"""Longest wait for the run's answer [s]."""


def carry_out(options: argparse.Namespace) -> int:
    """Give the order and print what came of it in one line; 3 where the guard refuses it."""
    run_dir = run_directory(options.run)
    name = f"{options.verb}-{secrets.token_hex(8)}"
    person, role, verb = options.person or _login(), Role(options.role), Verb(options.verb)
    command = PersonCommand(name, person, role, verb, options.subject, options.digest, options.reason)
    before = length(run_dir)
    post(run_dir, command)
    heard = wait_for(run_dir, name, before, ANSWER_S)
    if heard is None:
        left = take_back(run_dir, name)
        what = "the order was taken back" if left else "but has taken the order; look at what it does"
        raise UsageError(f"run {str(run_dir)!r} does not answer, {what}; it is over, or does not go on")
    about = f"{options.verb} {options.subject}".rstrip()
    print(printable(f"{about}: {_said(heard)}"))
    return 0 if heard.done or heard.counts else REFUSED


def _said(heard: Heard) -> str:
    """What came of an order, in words."""
    if heard.done:
        return "done"
    return f"heard; {heard.reason}" if heard.counts else f"refused, {heard.reason}"


def _login() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # an account without a name
        return f"user {os.getuid()}"
