"""``homeostat replay``: a recorded run told again."""

import argparse
import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

from homeostat.cli.arguments import UsageError
from homeostat.cli.recorded_plant import plant_of_run, unvouched
from homeostat.cli.run_directory import run_directory
from homeostat.domain.quotation import printable
from homeostat.evaluate.recorded.plant import recorded_place
from homeostat.history.times import read_span
from homeostat.journal import BrokenChain, Event, RunStarted, read_events
from homeostat.journal.verify.verify import verify
from homeostat.plants.plant import load_plant
from homeostat.record.decode import decode
from homeostat.record.result import read_result
from homeostat.record.story.story import Story
from homeostat.record.story.summary import summary
from homeostat.service.attached.place import KEPT, begins
from homeostat.service.what_if import WhatIf

_UNTOLD = (LookupError, TypeError, ValueError, ArithmeticError, AttributeError)
"""What words for a record of somebody else's making may run into."""


def carry_out(options: argparse.Namespace) -> int:
    """Show the run; 1 where its record is not whole."""
    run_dir = run_directory(options.run)
    if options.what_if:
        return _watch_again(options, run_dir)
    report = verify(run_dir)
    if options.json:
        _print_result(run_dir)
    else:
        _tell(run_dir, report.intact, options.case)
    if report.problem is not None:
        print(printable(f"homeostat: {str(run_dir)!r}: {report.problem}"), file=sys.stderr)
    return 0 if report.complete else 1


def _watch_again(options: argparse.Namespace, run_dir: Path) -> int:
    """Tell what today's configuration makes of the history; 0."""
    from homeostat.history.embedded.reading import EmbeddedHistory
    from homeostat.service.what_if import what_if

    started = begins(run_dir)
    if started is None:
        raise UsageError(f"{str(run_dir)!r} is no attached plant's: only the history of one can be watched again")
    if options.case is None and (place := unvouched(started, run_dir)) is not None:
        raise UsageError(f"nobody vouches for where the plant is ({place!r}), and it has code; name it with --case")
    plant = load_plant(options.case or recorded_place(started))
    beside = run_dir.resolve()
    history = EmbeddedHistory(options.history or beside.with_name(beside.name + KEPT))
    extent = history.extent()
    if extent is None:
        raise UsageError(f"the history of {str(run_dir)!r} has no samples yet")
    story = Story(plant.description, run_dir)

    def tell(event: Event, at_s: float) -> None:
        for line in story.tell(event, at_s):
            print(line)

    found = what_if(plant, history, read_span(options.last, getattr(options, "from"), options.to, extent), tell)
    print()
    for line in _in_words(found):
        print(printable(line))
    return 0


def _in_words(found: WhatIf) -> Iterator[str]:
    yield f"{found.from_s:.0f} s to {found.to_s:.0f} s, watched as configured today; nothing was written"
    if found.detected_s is None:
        yield "nothing would be noticed"
    else:
        yield f"noticed at {found.detected_s:.0f} s{f': {found.diagnosis}' if found.diagnosis else ''}"
    for advice in found.advice[:1]:
        to = ((c.tag, "automatic" if c.value is None else f"{c.value:.4g}") for c in advice.commands)
        yield f"would be released at {advice.at_s:.0f} s: {', '.join(f'{tag} to {value}' for tag, value in to)}"
    if not found.advice:
        yield "nothing would be released"
    for at_s, limit in found.trips[:5]:
        yield f"{limit} would trip at {at_s:.0f} s"


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
