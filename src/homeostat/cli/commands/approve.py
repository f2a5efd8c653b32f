"""``homeostat approve``: a request that waits is approved, or those that wait are listed."""

from __future__ import annotations

import argparse

from homeostat.cli.commands import orders
from homeostat.cli.options.arguments import UsageError
from homeostat.cli.options.records import LEAST_DIGITS
from homeostat.cli.run_directory import run_directory
from homeostat.cli.story.offers import Offers
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.quotation import printable
from homeostat.journal import Record, read_events
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.error import PlantError
from homeostat.plants.plant import load_plant
from homeostat.service.answers import Waiting, waiting
from homeostat.service.inbox import refuse_unattended


def carry_out(options: argparse.Namespace) -> int:
    """Approve a request, or list those that wait."""
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
    return orders.carry_out(options)


def _whole(digest: str, request: str, found: tuple[Waiting, ...]) -> str:
    """The whole digest of ``request`` where ``digest`` begins it; else ``digest``, which the guard will refuse."""
    if len(digest) < LEAST_DIGITS:
        raise UsageError(f"digest {digest!r} has {len(digest)} digits; give {LEAST_DIGITS} or more")
    return next((w.digest for w in found if w.request == request and w.digest.startswith(digest)), digest)


def _plant(records: tuple[Record, ...]) -> PlantDescription | None:
    """The plant of a run; None where it is not known here, or not like that: a person must decide all the same."""
    try:
        return load_plant(str(records[0].fields["case"]), learned=False).description
    except (PlantError, GraphError, LookupError):
        return None
