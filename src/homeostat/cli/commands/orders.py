"""What a person orders of a run that goes on: approve, reject, reset, mode, in-service, acknowledge, and more."""

import argparse
import getpass
import os
import secrets
from pathlib import Path
from typing import Final

from homeostat.cli.arguments import LEAST_DIGITS, UsageError
from homeostat.cli.giving import given
from homeostat.cli.offers import Offers
from homeostat.cli.recorded_plant import unvouched
from homeostat.cli.run_directory import run_directory
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.quotation import printable
from homeostat.evaluate.recorded.plant import recorded_place
from homeostat.journal import Record, RunStarted, read_events
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.error import PlantError
from homeostat.plants.plant import load_plant
from homeostat.record.decode import DecodeError, decode
from homeostat.service.answers import TELLING, Heard, Waiting, waiting
from homeostat.service.attached.place import begins
from homeostat.service.doors.asking import status
from homeostat.service.inbox import refuse_unattended

REFUSED: Final = 3
"""Exit status of an order that the guard refused."""


def carry_out(options: argparse.Namespace) -> int:
    """Give the order and print what came of it in one line; 3 where the guard refuses it."""
    run_dir = run_directory(options.run)
    name = f"{options.verb}-{secrets.token_hex(8)}"
    person, role, verb = options.person or _login(), Role(options.role), Verb(options.verb)
    seconds = 60.0 * getattr(options, "minutes", 0.0)
    about = options.subject, options.digest, options.reason
    command = PersonCommand(name, person, role, verb, *about, seconds=seconds)
    heard = given(run_dir, command)
    what = f"{options.verb} {options.subject}".rstrip()
    print(printable(f"{what}: {_said(heard)}"))
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


def approve(options: argparse.Namespace) -> int:
    """Approve a request, or list those that wait."""
    run_dir = run_directory(options.run)
    if not options.subject:
        if begins(run_dir) is not None:
            status(run_dir)  # refused where no service runs
        else:
            refuse_unattended(run_dir)
        records = tuple(read_events(run_dir))
        for line in Offers.of(records).lines(_plant(records, run_dir)):
            print(printable(line))
        return 0
    if not options.digest:
        raise UsageError(f"say what you approve with --digest; 'homeostat approve {options.run}' lists the requests")
    options.digest = _whole(options.digest, options.subject, waiting(read_events(run_dir, TELLING)))
    return carry_out(options)


def _whole(digest: str, request: str, found: tuple[Waiting, ...]) -> str:
    """The whole digest of ``request`` where ``digest`` begins it; else ``digest``, which the guard will refuse."""
    if len(digest) < LEAST_DIGITS:
        raise UsageError(f"digest {digest!r} has {len(digest)} digits; give {LEAST_DIGITS} or more")
    return next((w.digest for w in found if w.request == request and w.digest.startswith(digest)), digest)


def _plant(records: tuple[Record, ...], run_dir: Path) -> PlantDescription | None:
    """The plant of a run; None where it is not known here, or not like that: a person must decide all the same."""
    try:
        started = next(event for event in map(decode, records[:1]) if isinstance(event, RunStarted))
        if unvouched(started, run_dir) is not None:
            return None
        return load_plant(recorded_place(started), learned=False).description
    except (PlantError, GraphError, DecodeError, StopIteration):
        return None
