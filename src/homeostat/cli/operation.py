"""What the options of a run choose: the language model, mode, pace and people."""

import argparse
import logging
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Final

from homeostat.agents.language.named_model import NamedModel, NoSuchModel
from homeostat.cli.arguments import UsageError
from homeostat.cli.proposers import consulted, temperature
from homeostat.domain.mode import Mode, PersonCommand
from homeostat.domain.quotation import printable
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.plants.wired.assembly import Language
from homeostat.recovery.bounds import Budget
from homeostat.recovery.exchange.pacing import Pacing
from homeostat.service.inbox import Inbox
from homeostat.service.thinking.consulting import language_of


def speaker(options: argparse.Namespace) -> Language | None:
    """The model that the options name, ready to be asked; None for the search. UsageError where there is none."""
    try:
        return language_of(consulted(options))
    except NoSuchModel as error:
        raise UsageError(str(error)) from error


def budget(options: argparse.Namespace) -> Budget:
    """How long a recovery may think, as the options say."""
    return Budget() if options.budget is None else Budget(latency_s=options.budget)


def chosen_model(name: str, options: argparse.Namespace) -> NamedModel:
    """The model called ``name``, to be asked as the options say."""
    return NamedModel(name, options.local_only, tuple(options.allow_host), temperature(options), options.model_seed)


PACE: Final = 10.0
"""Process seconds per second of a run that waits for people, or that they look at, unless told otherwise."""


def check(options: argparse.Namespace) -> None:
    """Settle the pace; UsageError where time would pass in two ways.

    In mode approve a person decides while the plant goes on, in real time; everything else waits for its pace.
    """
    if options.people is not None and not options.console:
        raise UsageError("--people is for the page of the run: add --console")
    if (options.mode == "approve" or options.console) and options.pace is None:
        options.pace = PACE
    if options.mode == "approve" and (options.thinking_declared is not None or options.thinking_scale != 1.0):
        raise UsageError(
            "in mode approve a person decides in real time; leave --thinking-declared and --thinking-scale out"
        )


def thinking(options: argparse.Namespace) -> Thinking:
    """What thinking costs: in real time it takes as long as the plant goes on meanwhile."""
    return Thinking(options.pace if options.mode == "approve" else options.thinking_scale, options.thinking_declared)


def chosen(options: argparse.Namespace, run_dir: Path) -> Operation:
    """What was chosen for the run that is kept in ``run_dir``, which gets an inbox where time is paced."""
    if options.pace is None:
        return Operation(Mode(options.mode), persons=options.persons)
    return paced(Operation(Mode(options.mode), persons=options.persons), options.pace, run_dir)


def paced(operation: Operation, pace: float, run_dir: Path) -> Operation:
    """The run in ``run_dir``, as in ``operation``, but at ``pace``, so that it takes orders."""
    operation = replace(operation, orders=orders_to(run_dir))
    if operation.mode is Mode.APPROVE:
        return replace(operation, pace=pace)
    return replace(operation, pacing=Pacing(pace))


def orders_to(run_dir: Path) -> Callable[[], Iterable[PersonCommand]]:
    """Asks the inbox of the run in ``run_dir``, which is made; what it cannot take is said on standard error."""
    inbox = Inbox(run_dir)

    def orders() -> Iterable[PersonCommand]:
        found = inbox.poll()
        for trouble in inbox.take_troubles():
            logging.getLogger("homeostat.service").warning("%s", printable(trouble))
        return found

    return orders
