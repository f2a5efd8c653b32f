"""What a person orders of a run that goes on: approve, reject, reset, mode, in-service, acknowledge, and more."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Final

from homeostat.cli.options.arguments import UsageError

if TYPE_CHECKING:
    from homeostat.cli.options.arguments import Commands, Parser
    from homeostat.domain.plant.description import PlantDescription
    from homeostat.journal import Record
    from homeostat.service.answers import Heard, Waiting

REFUSED: Final = 3
"""Exit status of an order that the guard refused."""
ANSWER_S: Final = 10.0
"""Longest wait for the run's answer [s]."""
LEAST_DIGITS: Final = 8
"""Fewest digits that name a digest."""
_EPILOG: Final = (
    "Exit status: 0 done, or heard where more people must order it; 3 refused by the guard, which says why; 2 no such "
    "run, it is over, or it does not answer. "
    "Name and role are a claim: the guard checks what the role may order and journals both; simulation trusts them."
)


def configure(commands: Commands) -> None:
    """Declare the commands."""
    approve = _order(commands, "approve", "say yes to a request that waits, or list the requests that wait", "operator")
    approve.add_argument("subject", nargs="?", default="", metavar="REQUEST", help="the request; left out: list them")
    approve.add_argument("--digest", metavar="D", help=f"digest of what is approved, {LEAST_DIGITS} digits or more")
    approve.set_defaults(carry_out=_approve)
    reject = _order(commands, "reject", "say no to a request that waits", "operator", reason="required")
    reject.add_argument("subject", metavar="REQUEST", help="the request")
    _order(commands, "reset", "reset the latch after a fallback; the plant stands in observe then", "engineer",
           reason="required")  # fmt: skip
    mode = _order(commands, "mode", "change what may be done to the plant", "engineer", reason="possible")
    mode.add_argument("subject", metavar="MODE", help="observe, advise, approve or closed-loop")
    service = _order(commands, "in-service", "bring a writable tag back, or take it out", "operator", reason="possible")
    service.add_argument("subject", metavar="TAG", help="the tag")
    service.add_argument(
        "--out", action="store_const", dest="verb", const="out-of-service", help="take it out; with --reason"
    )
    seen = _order(commands, "acknowledge", "say that an alarm was seen", "operator")
    seen.add_argument("subject", metavar="ALARM", help="the alarm, as the run shows it")
    _order(commands, "fall-back", "have the fallback act now", "engineer", reason="required")
    start = _order(commands, "start", "take a transition that leads back to a start", "engineer")
    start.add_argument("subject", metavar="TRANSITION", help="the transition, as the tables name it")


def _order(commands: Commands, verb: str, help_: str, role: str, reason: str = "none") -> Parser:
    """A command with what every order has; ``reason`` is ``none``, ``possible`` or ``required``."""
    command = commands.add_parser(
        verb, help=help_, description=f"Order a run that goes on: {help_}.", epilog=_EPILOG, allow_abbrev=False
    )
    command.add_argument("run", type=Path, metavar="RUN", help="run directory")
    if reason != "none":
        command.add_argument(
            "--reason", required=reason == "required", default="", metavar="R", help="why, in your words"
        )
    command.add_argument("--person", metavar="NAME", help="who orders it (default: the login name)")
    command.add_argument(
        "--role", choices=("operator", "engineer"), default=role, help=f"in which role (default: {role})"
    )
    command.set_defaults(carry_out=carry_out, verb=verb, subject="", digest="", reason="")
    return command


def carry_out(options: argparse.Namespace) -> int:
    """Give the order and print what came of it in one line; 3 where the guard refuses it."""
    import secrets

    from homeostat.cli.commands.trace_verify import run_directory
    from homeostat.domain.mode import PersonCommand, Role, Verb
    from homeostat.domain.quotation import printable
    from homeostat.service.answers import length, wait_for
    from homeostat.service.inbox import post, take_back

    run_dir = run_directory(options.run)
    name = f"{options.verb}-{secrets.token_hex(8)}"
    command = PersonCommand(
        name, options.person or _login(), Role(options.role), Verb(options.verb), options.subject, options.digest,
        options.reason,
    )  # fmt: skip
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


def _approve(options: argparse.Namespace) -> int:
    """Approve a request, or list those that wait."""
    from homeostat.cli.commands.trace_verify import run_directory
    from homeostat.cli.story.offers import Offers
    from homeostat.domain.quotation import printable
    from homeostat.journal import read_events
    from homeostat.service.answers import waiting
    from homeostat.service.inbox import refuse_unattended

    run_dir = run_directory(options.run)
    if not options.subject:
        refuse_unattended(run_dir)
        records = tuple(read_events(run_dir))
        for line in Offers.of(records).lines(_plant(records)):
            print(printable(line))
        return 0
    if not options.digest:
        raise UsageError(f"say what you approve with --digest; 'homeostat approve {options.run}' lists the requests")
    options.digest = _whole(options.digest, options.subject, waiting(read_events(run_dir)))
    return carry_out(options)


def _whole(digest: str, request: str, found: tuple[Waiting, ...]) -> str:
    """The whole digest of ``request`` where ``digest`` begins it; else ``digest``, which the guard will refuse."""
    if len(digest) < LEAST_DIGITS:
        raise UsageError(f"digest {digest!r} has {len(digest)} digits; give {LEAST_DIGITS} or more")
    return next((w.digest for w in found if w.request == request and w.digest.startswith(digest)), digest)


def _plant(records: tuple[Record, ...]) -> PlantDescription | None:
    """The plant of a run; None where it is not known here, or not like that: a person must decide all the same."""
    from homeostat.knowledge.store.error import GraphError
    from homeostat.plants.error import CaseError
    from homeostat.plants.plant import load_case

    try:
        return load_case(str(records[0].fields["case"]), learned=False).description
    except (CaseError, GraphError, LookupError):
        return None


def _login() -> str:
    import getpass
    import os

    try:
        return getpass.getuser()
    except (KeyError, OSError):  # an account without a name
        return f"user {os.getuid()}"
