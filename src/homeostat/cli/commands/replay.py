"""``homeostat replay``: a recorded run told again."""

import argparse
import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

from homeostat.cli.arguments import UsageError
from homeostat.cli.commands.trace_verify import trusted
from homeostat.cli.run_directory import run_directory
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.quotation import printable
from homeostat.evaluate.recorded.plant import recorded_folder, recorded_plant_of
from homeostat.journal import BrokenChain, RunStarted, read_events
from homeostat.journal.signing.keys import KeyTrouble
from homeostat.journal.verify.verify import verify
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED
from homeostat.plants.files.places import shipped_names
from homeostat.plants.plant import load_plant
from homeostat.record.decode import DecodeError, decode
from homeostat.record.result import ResultError, read_result
from homeostat.record.story.story import Story
from homeostat.record.story.summary import summary
from homeostat.record.story.unknown_plant import unknown_plant

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
                plant = _plant(event, run_dir, given)
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


def _plant(started: RunStarted, run_dir: Path, given: str | None) -> PlantDescription:
    """The plant of the run, whose words and units tell it; what the run says itself where that is not to be had.

    A plant has code, so where it is, is not taken from a journal that nobody vouches for.
    """
    folder = recorded_folder(started)
    try:
        if given is None and folder is not None and not vouched(run_dir):
            raise PlantError(f"nobody vouches for where the run's plant is ({folder!r}); name its folder with --case")
        return recorded_plant_of(started, given).description
    except (PlantError, GraphError) as error:
        if given is not None:
            raise
        installed = folder is None and started.case in shipped_names()
        words = "told in the words of the installed plant" if installed else "told without the plant's words and units"
        print(printable(f"homeostat: {error}; {words}"), file=sys.stderr)
        if installed:
            return load_plant(str(INSTALLED / started.case)).description
        return unknown_plant(started.case, _told(run_dir))


def vouched(run_dir: Path) -> bool:
    """Whether a trusted key signed how the run began."""
    try:
        return verify(run_dir, trusted(None)).vouched.lines > 0
    except KeyTrouble:
        return False


def _told(run_dir: Path) -> Iterator[object]:
    """Everything that the run has kept, up to where it cannot be read any more."""
    with contextlib.suppress(BrokenChain, DecodeError):
        for record in read_events(run_dir):
            yield decode(record)
    with contextlib.suppress(ResultError):
        yield read_result(run_dir)


@contextlib.contextmanager
def _telling(what: str, remedy: str) -> Iterator[None]:
    """UsageError where ``what`` is of a plant that this installation does not know like that."""
    try:
        yield
    except _UNTOLD as error:
        raise UsageError(f"{what} cannot be told: {error!r}; {remedy}") from error
