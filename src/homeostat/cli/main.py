"""From the arguments to the exit status."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from io import TextIOWrapper

from homeostat.cli.arguments import UsageError
from homeostat.cli.notices import notices
from homeostat.cli.parser import parser

BAD_USAGE = 2
"""The command cannot be carried out as it was given."""
INTERRUPTED = 130
"""Stopped by Ctrl-C, as a shell reports it."""
NOBODY_READS = 141
"""Whoever read the output has gone, as a shell reports it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry a command out; the exit status. A mistake in the command is one line on standard error, a bug a traceback.

    ``arguments`` are the process's own where None.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal without Unicode must not stop a run
    options = parser().parse_args(arguments)
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
    try:
        status: int = options.carry_out(options)
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
    from homeostat.campaign.recall import RecallError
    from homeostat.campaign.recording import RunDirectoryError
    from homeostat.campaign.result import ResultError
    from homeostat.campaign.resumption import ResumptionError
    from homeostat.campaign.scenario import ScenarioError
    from homeostat.campaign.study.error import CampaignError
    from homeostat.cases.error import CaseError
    from homeostat.knowledge.graph_error import GraphError
    from homeostat.knowledge.store import StoreError
    from homeostat.service.order import OrderError
    from homeostat.trace import BrokenChain
    from homeostat.trace.keys import KeyTrouble

    return (
        BrokenChain, CampaignError, CaseError, GraphError, KeyTrouble, OrderError, RecallError, ResultError,
        ResumptionError, RunDirectoryError, ScenarioError, StoreError,
    )  # fmt: skip
