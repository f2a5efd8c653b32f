"""``homeostat replay``: a recorded run told again."""

import argparse
import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

from homeostat.cli.arguments import UsageError
from homeostat.cli.recorded_plant import plant_of_run
from homeostat.cli.run_directory import run_directory
from homeostat.domain.quotation import printable
from homeostat.journal import BrokenChain, RunStarted, read_events
from homeostat.journal.verify.verify import verify
from homeostat.record.decode import decode
from homeostat.record.result import read_result
from homeostat.record.story.story import Story
from homeostat.record.story.summary import summary

_UNTOLD = (LookupError, TypeError, ValueError, ArithmeticError, AttributeError)
"""What words for a record of somebody else's making may run into."""


def carry_out(options: argparse.Namespace) -> int:
    """Show the run; 1 where its record is not whole."""
    run_dir = run_directory(options.run)
    report = verify(run_dir)
    if options.json:
        _print_result(run_dir)
    else:
        _tell(run_dir, report.intact, options.case)
    if report.problem is not None:
        print(printable(f"homeostat: {str(run_dir)!r}: {report.problem}"), file=sys.stderr)
    return 0 if report.complete else 1


def _print_result(run_dir: Path) -> None:
    result = read_result(run_dir)
    if result is None:
        raise UsageError(f"run {str(run_dir)!r} has no result: it did not come to its end; replay it without --json")
    print(result.to_json())


def _tell(run_dir: Path, intact: bool, given: str | None) -> None:
    story = plant = None
    try:
        for record in read_events(run_dir):
            event = decode(record)
            if isinstance(event, RunStarted):
                plant = plant_of_run(event, run_dir, given)[0]
                story = Story(plant, run_dir)
            if event is not None and story is not None:
                what = f"event {record.seq} ({record.kind!r})"
                with _telling(what, "its plant is not the one known here"):
                    lines = list(story.tell(event, record.happened_s))
                print(*lines, sep="\n", end="\n" * bool(lines))
    except BrokenChain:
        return  # what follows cannot be trusted; the report says where
    result = read_result(run_dir) if intact else None
    if result is not None and story is not None and plant is not None:
        with _telling(f"the result of {str(run_dir)!r}", "verify the run"):
            end = list(summary(result, story, plant, run_dir))
        print("", *end, sep="\n")


@contextlib.contextmanager
def _telling(what: str, remedy: str) -> Iterator[None]:
    """UsageError where ``what`` is of a plant that this installation does not know like that."""
    try:
        yield
    except _UNTOLD as error:
        raise UsageError(f"{what} cannot be told: {error!r}; {remedy}") from error
