"""How a run is operated: mode, pace and people."""

import argparse
import logging
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

from homeostat.cli.arguments import UsageError
from homeostat.domain.mode import Mode, PersonCommand
from homeostat.domain.quotation import printable
from homeostat.evaluate.operation import Operation
from homeostat.service.inbox import Inbox

PACE: Final = 10.0
"""Process seconds per second of a run that waits for people, unless told otherwise."""


def check(options: argparse.Namespace) -> None:
    """Settle the pace; UsageError where time would pass in two ways."""
    if options.mode == "approve" and options.pace is None:
        options.pace = PACE
    if options.pace is not None and (options.thinking_declared is not None or options.thinking_scale != 1.0):
        raise UsageError("a paced run thinks in real time; leave --thinking-declared and --thinking-scale out")


def chosen(options: argparse.Namespace, run_dir: Path) -> Operation:
    """What was chosen for the run that is kept in ``run_dir``, which gets an inbox where time is paced."""
    if options.pace is None:
        return Operation(Mode(options.mode), persons=options.persons)
    return Operation(Mode(options.mode), options.pace, orders_to(run_dir), options.persons)


def orders_to(run_dir: Path) -> Callable[[], Iterable[PersonCommand]]:
    """Asks the inbox of the run in ``run_dir``, which is made; what it cannot take is said on standard error."""
    inbox = Inbox(run_dir)

    def orders() -> Iterable[PersonCommand]:
        found = inbox.poll()
        for trouble in inbox.take_troubles():
            logging.getLogger("homeostat.service").warning("%s", printable(trouble))
        return found

    return orders
