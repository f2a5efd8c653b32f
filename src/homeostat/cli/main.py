"""From the arguments to the exit status."""

import argparse
import contextlib
import logging
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from importlib import import_module
from io import TextIOWrapper
from typing import final

from homeostat.cli.arguments import UsageError
from homeostat.cli.parser import parser

BAD_USAGE = 2
"""The command cannot be carried out as it was given."""
INTERRUPTED = 130
"""Stopped by Ctrl-C, as a shell reports it."""
NOBODY_READS = 141
"""Whoever read the output has gone, as a shell reports it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry a command out; the exit status. A mistake in the command is one line on standard error, a bug raises."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal without Unicode must not stop a run
    options, unknown = parser().parse_known_args(arguments)
    if unknown:
        options.command.error(f"unrecognized arguments: {' '.join(unknown)}")
    try:
        with notices():
            status: int = _carried_out(options)
        sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        warnings.simplefilter("ignore", RuntimeWarning)  # of a coroutine that was just about to begin
        return _fail("interrupted", INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the interpreter flushes once more at its end
        return NOBODY_READS
    except (UsageError, OSError) as error:
        return _fail(_words(error), BAD_USAGE)
    except Exception as error:
        if isinstance(error, _refusals()):
            return _fail(_words(error), BAD_USAGE)
        raise


def _carried_out(options: argparse.Namespace) -> int:
    """The command's exit status, which nothing inside it may choose by ending the process."""
    module, _, function = options.carry_out.partition(":")
    try:
        status: int = getattr(import_module(f"homeostat.cli.commands.{module}"), function)(options)
    except SystemExit as end:
        raise RuntimeError(f"the command was ended from within, with status {end.code!r}") from end
    return status


def _fail(message: str, status: int) -> int:
    from homeostat.domain.quotation import printable

    print(f"homeostat: {printable(' '.join(message.split()))}", file=sys.stderr)
    return status


def _words(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f"{os.fspath(error.filename)!r} cannot be used: {error.strerror}"
    return str(error)


def _refusals() -> tuple[type[Exception], ...]:
    """Exceptions that say what is wrong with what was asked for, not with the program."""
    from homeostat.detectors.error import DetectionError
    from homeostat.evaluate.recorded.adoption import AdoptionError
    from homeostat.evaluate.recorded.resumption import ResumptionError
    from homeostat.evaluate.scenario import ScenarioError
    from homeostat.evaluate.study.error import StudyError
    from homeostat.history.store import HistoryError
    from homeostat.journal import BrokenChain
    from homeostat.journal.signing.keys import KeyTrouble
    from homeostat.knowledge.store.error import GraphError
    from homeostat.knowledge.store.store import StoreError
    from homeostat.links.errors import LinkError
    from homeostat.plants.error import PlantError
    from homeostat.record.decode import DecodeError
    from homeostat.record.directory import RunDirectoryError
    from homeostat.record.playbook import PlaybookError
    from homeostat.record.result import ResultError
    from homeostat.service.order import OrderError

    of_runs = (BrokenChain, KeyTrouble, OrderError, DecodeError, ResultError, ResumptionError, RunDirectoryError)
    of_plants = (AdoptionError, PlaybookError, StudyError, PlantError, GraphError, ScenarioError)
    return *of_runs, *of_plants, DetectionError, HistoryError, LinkError, StoreError


@contextlib.contextmanager
def notices() -> Iterator[None]:
    """Tell what the package logs as a warning, as long as this lasts; a terminal view moves out of its way."""
    logger, handler = logging.getLogger("homeostat"), _Teller(logging.WARNING)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


@final
class _Teller(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(OSError):  # nobody reads it: no reason to stop either
            print(f"homeostat: {' '.join(record.getMessage().split())}", file=sys.stderr, flush=True)
