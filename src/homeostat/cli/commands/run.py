"""``homeostat run``: one scenario from start to score, shown as it happens and kept."""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from homeostat.agents.playbook.book import Book
from homeostat.agents.roles import AskingProtocol
from homeostat.cli import operation
from homeostat.cli.arguments import UsageError
from homeostat.cli.views import PlainView, View
from homeostat.domain.quotation import printable
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.evaluate.playbook.recoveries import entries_of
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.recorded.history import RunHistory
from homeostat.evaluate.recorded.run import record_run
from homeostat.evaluate.run import Run
from homeostat.evaluate.scenario import Scenario, departing, repaired, scenario
from homeostat.journal import Event
from homeostat.journal.beside.files import RESULT
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import check_protocol
from homeostat.plants.wired.playbook import NAME, open_playbook
from homeostat.record.directory import RunDirectory
from homeostat.record.playbook import PlaybookError, add_to_playbook
from homeostat.record.story.story import Story
from homeostat.record.story.summary import summary

if TYPE_CHECKING:
    from homeostat.cli.live import LivePage

RUNS = Path("runs")
"""Where runs are kept unless told otherwise."""
STATUS = {
    **dict.fromkeys(("recovered", "no_action"), 0),
    **dict.fromkeys(("held", "fallback"), 3),
    **dict.fromkeys(("needless_action", "not_detected"), 4),
    "limit_violated": 5,
}
"""Outcome -> exit status."""
SECOND_US = 1_000_000
"""A second [us]."""
NOT_STORED = 1
"""Exit status of a run whose result could not be stored; what it came to is printed all the same."""


def carry_out(options: argparse.Namespace) -> int:
    """Check everything, run, show, keep; the exit status says what happened (:data:`STATUS`)."""
    speaker = operation.speaker(options)
    operation.check(options)
    live = _live_page(options.people) if options.console or options.people else None
    plant = load_plant(options.case)
    playbook = _playbook(options, plant)
    chosen = scenario(
        plant, options.fault, options.seed, options.onset, options.severity, options.end, options.location
    )
    chosen = repaired(departing(plant, chosen, options.disturb, options.mismatch), options.repair)
    thinking = operation.thinking(options)
    conditions = Conditions(AskingProtocol(options.protocol), options.label_given)
    check_protocol(plant, conditions.protocol)  # before a directory is made
    with _history(options.history, plant) as history:
        directory = _directory(options, plant, chosen)
        operated = operation.chosen(options, directory.path)
        page = None if live is None else live(plant, directory.path, operated)
        if history is not None:
            operated = replace(operated, onlooker=history.see)
        budget, book = operation.budget(options), playbook and playbook.book
        proposing = Proposing(speaker, conditions, budget=budget, playbook=book)
        going = Going(
            plant, chosen, directory, thinking, options.proposer, proposing, operated, playbook, history, page
        )
        status = carry(going, options.json)
    if page is not None:
        page.stay()
    return status


def _directory(options: argparse.Namespace, plant: Plant, chosen: Scenario) -> RunDirectory:
    """Where the run is kept; it is said where nobody signs it."""
    if options.out is not None:
        directory = RunDirectory(options.out)
    else:
        directory = RunDirectory.next_free(RUNS, f"{plant.name}-{chosen.fault}-{chosen.seed}")
    if directory.unsigned:
        print(f"homeostat: the run is not signed: {printable(directory.unsigned)}", file=sys.stderr)
    return directory


@contextmanager
def _history(folder: Path | None, plant: Plant) -> Iterator[RunHistory | None]:
    """The history that the run is added to; what it could not take is said on standard error."""
    if folder is None:
        yield None
        return
    from homeostat.history.embedded.store import EmbeddedStore  # pyarrow loads slowly

    with EmbeddedStore(folder) as store:
        before = store.extent()
        start_us = max(time.time_ns() // 1000, 0 if before is None else before.to_us)
        yield RunHistory(store, plant.name, -(-start_us // SECOND_US) * SECOND_US)
    for trouble in store.take_troubles():
        print(f"homeostat: {printable(trouble)}", file=sys.stderr)


class Playbook(NamedTuple):
    """A playbook that a run begins with, and adds to."""

    path: Path
    book: Book
    raw: bytes

    def keep(self, directory: RunDirectory) -> None:
        """Keep what it was in the run's own directory: the run can be repeated, and its manifest has the digest."""
        with directory.spared(NAME):
            directory.store_whole(NAME, self.raw)

    def add(self, done: Run) -> None:
        """Add what was recovered; a file that does not take it is told, and the run is what it was."""
        try:
            number = add_to_playbook(self.path, entries_of(done))
        except (OSError, PlaybookError) as error:
            print(f"homeostat: the playbook was not added to: {printable(str(error))}", file=sys.stderr)
        else:
            entries = "entry" if number == 1 else "entries"
            print(f"homeostat: {number} {entries} added to {printable(str(self.path))}", file=sys.stderr)


def _playbook(options: argparse.Namespace, plant: Plant) -> Playbook | None:
    """The playbook that the options name, read once: what becomes of the file later is nothing to the run."""
    if options.playbook is None:
        return None
    book, content = open_playbook(options.playbook, plant)
    return Playbook(options.playbook, book, content.raw)


class Going(NamedTuple):
    """A run that was checked and may begin."""

    plant: Plant
    chosen: Scenario
    directory: RunDirectory
    thinking: Thinking
    proposer: str
    proposing: Proposing
    operation: Operation
    playbook: Playbook | None = None
    history: RunHistory | None = None
    page: "LivePage | None" = None


def _live_page(people: Path | None) -> "Callable[[Plant, Path, Operation], LivePage]":
    """Shows a run while it goes on; UsageError where the extra is not installed, or ``people`` cannot be used."""
    try:
        from homeostat.cli.live import LivePage
        from homeostat.cli.serving import known
    except ImportError as error:
        raise UsageError(f"--console needs {error.name!r}: pip install 'homeostat[console]'") from error
    there = known(people)
    return lambda plant, run_dir, operation: LivePage(plant, run_dir, there, operation)


def carry(going: Going, as_json: bool) -> int:
    """Run, show, keep; the exit status."""
    plant, chosen, directory = going.plant, going.chosen, going.directory
    story, view = Story(plant.description, directory.path), _view(plant, chosen, as_json)

    if going.operation.past is not None:
        for before in going.operation.past.record.entries:
            list(story.tell(before.event, before.at_s))  # told when it happened

    def on_event(event: Event, at_s: float) -> None:
        lines = list(story.tell(event, at_s))
        for line in lines:
            view.show(line)
        if going.history is not None:
            going.history.hear(event, at_s, "; ".join(line.text for line in lines))

    def on_snapshot(snapshot: Snapshot) -> None:
        for line in story.watch(snapshot.at_s):
            view.show(line)
        view.progress(snapshot.at_s, snapshot.values, story.phase, story.state)
        if going.page is not None:
            going.page.see(snapshot)

    try:
        with directory:
            if going.playbook is not None:
                going.playbook.keep(directory)
            what = (plant, chosen, directory, going.thinking, going.proposer, on_event, on_snapshot)
            done = record_run(*what, going.proposing, going.operation)
    finally:
        view.close()
    for trouble in directory.take_troubles():
        print(f"homeostat: {printable(trouble)}", file=sys.stderr)
    if going.playbook is not None:
        going.playbook.add(done)
    result = done.result(directory.path)
    if as_json:
        print(result.to_json())
    else:
        print("", *summary(result, story, plant.description, directory.path), sep="\n")
    if directory.missing:
        words = f"the record in {str(directory.path)!r} is incomplete: {directory.missing}"
        print(f"homeostat: {printable(words)}", file=sys.stderr)
    return STATUS[result.outcome] if directory.keeps(RESULT) else NOT_STORED


def _view(plant: Plant, chosen: Scenario, as_json: bool) -> View:
    """A terminal is shown the run live; a pipe gets lines; with JSON, standard output stays free."""
    stream = sys.stderr if as_json else sys.stdout
    if stream.isatty():
        from homeostat.cli.terminal import TerminalView

        first = dict.fromkeys(panel.tags[0] for panel in plant.panels)
        return TerminalView(stream, chosen.end_s, [plant.description.tag(tag) for tag in list(first)[:2]])
    return PlainView(None if as_json else stream)
