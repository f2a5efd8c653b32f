"""``homeostat run``: one scenario from start to score, shown as it happens and kept."""

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

from homeostat.agents.roles import AskingProtocol
from homeostat.cli import operation
from homeostat.cli.views import PlainView, View
from homeostat.domain.quotation import printable
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.recorded.run import record_run
from homeostat.evaluate.scenario import Scenario, departing, repaired, scenario
from homeostat.journal import Event
from homeostat.journal.beside.files import RESULT
from homeostat.plants.assembly import check_protocol
from homeostat.plants.plant import Plant, load_plant
from homeostat.record.directory import RunDirectory
from homeostat.record.story.story import Story
from homeostat.record.story.summary import summary

RUNS = Path("runs")
"""Where runs are kept unless told otherwise."""
STATUS = {
    **dict.fromkeys(("recovered", "no_action"), 0),
    **dict.fromkeys(("held", "fallback"), 3),
    **dict.fromkeys(("needless_action", "not_detected"), 4),
    "limit_violated": 5,
}
"""Outcome -> exit status."""
NOT_STORED = 1
"""Exit status of a run whose result could not be stored; what it came to is printed all the same."""


def carry_out(options: argparse.Namespace) -> int:
    """Check everything, run, show, keep; the exit status says what happened (:data:`STATUS`)."""
    speaker = operation.speaker(options)
    operation.check(options)
    plant = load_plant(options.case)
    chosen = scenario(
        plant, options.fault, options.seed, options.onset, options.severity, options.end, options.location
    )
    chosen = repaired(departing(plant, chosen, options.disturb, options.mismatch), options.repair)
    thinking = Thinking(options.thinking_scale if options.pace is None else options.pace, options.thinking_declared)
    conditions = Conditions(AskingProtocol(options.protocol), options.label_given)
    check_protocol(plant, conditions.protocol)  # before a directory is made
    if options.out is not None:
        directory = RunDirectory(options.out)
    else:
        directory = RunDirectory.next_free(RUNS, f"{plant.name}-{chosen.fault}-{chosen.seed}")
    if directory.unsigned:
        print(f"homeostat: the run is not signed: {printable(directory.unsigned)}", file=sys.stderr)
    operated = operation.chosen(options, directory.path)
    proposing = Proposing(speaker, conditions, budget=operation.budget(options))
    going = Going(plant, chosen, directory, thinking, options.proposer, proposing, operated)
    return carry(going, options.json)


class Going(NamedTuple):
    """A run that was checked and may begin."""

    plant: Plant
    chosen: Scenario
    directory: RunDirectory
    thinking: Thinking
    proposer: str
    proposing: Proposing
    operation: Operation


def carry(going: Going, as_json: bool) -> int:
    """Run, show, keep; the exit status."""
    plant, chosen, directory = going.plant, going.chosen, going.directory
    story, view = Story(plant.description, directory.path), _view(plant, chosen, as_json)

    if going.operation.past is not None:
        for before in going.operation.past.record.entries:
            list(story.tell(before.event, before.at_s))  # told when it happened

    def on_event(event: Event, at_s: float) -> None:
        for line in story.tell(event, at_s):
            view.show(line)

    def on_snapshot(snapshot: Snapshot) -> None:
        for line in story.watch(snapshot.at_s):
            view.show(line)
        view.progress(snapshot.at_s, snapshot.values, story.phase, story.state)

    try:
        with directory:
            what = (plant, chosen, directory, going.thinking, going.proposer, on_event, on_snapshot)
            done = record_run(*what, going.proposing, going.operation)
    finally:
        view.close()
    for trouble in directory.take_troubles():
        print(f"homeostat: {printable(trouble)}", file=sys.stderr)
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
