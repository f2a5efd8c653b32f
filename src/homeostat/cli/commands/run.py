"""``homeostat run``: one scenario from start to score, shown as it happens and kept."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from homeostat.cli.options import language, operation
from homeostat.cli.options.arguments import number

if TYPE_CHECKING:
    from homeostat.cli.options.arguments import Commands
    from homeostat.cli.views import View
    from homeostat.evaluate.conditions.conditions import Conditions
    from homeostat.evaluate.operation import Operation
    from homeostat.evaluate.scenario import Scenario
    from homeostat.evaluate.thinking import Thinking
    from homeostat.plants.assembly import Language
    from homeostat.plants.plant import Case
    from homeostat.record.directory import RunDirectory

RUNS = Path("runs")
"""Where runs are kept unless told otherwise."""
STATUS = {
    "recovered": 0, "no_action": 0, "held": 3, "fallback": 3, "needless_action": 4, "not_detected": 4,
    "limit_violated": 5,
}  # fmt: skip
"""Outcome -> exit status."""

NOT_STORED = 1
"""Exit status of a run whose result could not be stored; what it came to is printed all the same."""


def configure(commands: Commands) -> None:
    """Declare the command."""
    command = commands.add_parser(
        "run",
        help="run one scenario and keep it",
        description="Run one scenario of a plant: with a fault or without, from start-up to the end, with its score.",
        epilog="'homeostat cases' lists the plants and their faults.",
        allow_abbrev=False,
    )
    command.add_argument("case", metavar="CASE", help="name of the plant")
    command.add_argument("--fault", default="none", metavar="F", help="fault; several joined by '+' (default: none)")
    command.add_argument(
        "--seed", type=int, default=1, metavar="N", help="seed of the plant and its noise (default: 1)"
    )
    command.add_argument("--onset", type=number(), metavar="S", help="when the fault begins [s of process time]")
    command.add_argument("--location", metavar="L", help="where the fault is, for faults with several places")
    command.add_argument("--severity", type=number(), metavar="X", help="size of the fault, in its unit")
    command.add_argument("--end", type=number(), metavar="S", help="when the run ends [s of process time]")
    language.configure(command)
    command.add_argument(
        "--protocol", choices=("route", "per-step"), default="route",
        help="per-step: agents are asked in every state, a language model for the next step only (default: route)",
    )  # fmt: skip
    command.add_argument(
        "--label-given", action="store_true", help="tell the agents the true fault, as in studies without detection"
    )
    command.add_argument("--out", type=Path, metavar="DIR", help="new or empty directory to keep the run in")
    command.add_argument("--json", action="store_true", help="print the result as one JSON object and nothing else")
    operation.configure(command)
    thinking = command.add_mutually_exclusive_group()
    thinking.add_argument(
        "--thinking-scale", type=number(0.0, 1000.0), default=1.0, metavar="K",
        help="process seconds per second of thinking (default: 1; 0: the plant waits)",
    )  # fmt: skip
    thinking.add_argument(
        "--thinking-declared", type=number(0.0, 3600.0), metavar="S",
        help="process seconds that each thought takes, whatever it took: equal seeds give equal runs",
    )  # fmt: skip
    command.set_defaults(carry_out=carry_out)


def carry_out(options: argparse.Namespace) -> int:
    """Check everything, run, show, keep; the exit status says what happened (:data:`STATUS`)."""
    speaker = language.speaker(options)
    operation.check(options)

    from homeostat.agents.roles import AskingProtocol
    from homeostat.domain.quotation import printable
    from homeostat.evaluate.conditions.conditions import Conditions
    from homeostat.evaluate.scenario import scenario
    from homeostat.evaluate.thinking import Thinking
    from homeostat.plants.assembly import check_protocol
    from homeostat.plants.plant import load_case
    from homeostat.record.directory import RunDirectory

    case = load_case(options.case)
    chosen = scenario(case, options.fault, options.seed, options.onset, options.severity, options.end, options.location)
    thinking = Thinking(options.thinking_scale if options.pace is None else options.pace, options.thinking_declared)
    conditions = Conditions(AskingProtocol(options.protocol), options.label_given)
    check_protocol(case, conditions.protocol)  # before a directory is made
    if options.out is not None:
        directory = RunDirectory(options.out)
    else:
        directory = RunDirectory.next_free(RUNS, f"{case.name}-{chosen.fault}-{chosen.seed}")
    if directory.unsigned:
        print(f"homeostat: the run is not signed: {printable(directory.unsigned)}", file=sys.stderr)
    operated = operation.chosen(options, directory.path)
    going = Going(case, chosen, directory, thinking, options.proposer, speaker, conditions, operated)
    return carry(going, options.json)


class Going(NamedTuple):
    """A run that was checked and may begin."""

    case: Case
    chosen: Scenario
    directory: RunDirectory
    thinking: Thinking
    proposer: str
    speaker: Language | None
    conditions: Conditions
    operation: Operation


def carry(going: Going, as_json: bool) -> int:
    """Run, show, keep; the exit status."""
    from homeostat.cli.story.story import Story
    from homeostat.cli.story.summary import summary
    from homeostat.domain.quotation import printable
    from homeostat.domain.snapshot import Snapshot
    from homeostat.evaluate.recorded_run import record_run
    from homeostat.journal import Event
    from homeostat.record.result import RESULT

    case, chosen, directory = going.case, going.chosen, going.directory
    story, view = Story(case.description, directory.path), _view(case, chosen, as_json)

    if going.operation.past is not None:
        for before, at_s in going.operation.past.events:
            list(story.tell(before, at_s))  # told when it happened

    def on_event(event: Event, at_s: float) -> None:
        for line in story.tell(event, at_s):
            view.show(line)

    def on_snapshot(snapshot: Snapshot) -> None:
        for line in story.watch(snapshot.at_s):
            view.show(line)
        view.progress(snapshot.at_s, snapshot.values, story.phase, story.state)

    try:
        with directory:
            done = record_run(
                case, chosen, directory, going.thinking, going.proposer, on_event, on_snapshot, going.speaker,
                going.conditions, operation=going.operation,
            )  # fmt: skip
    finally:
        view.close()
    for trouble in directory.take_troubles():
        print(f"homeostat: {printable(trouble)}", file=sys.stderr)
    result = done.result(directory.path)
    if as_json:
        print(result.to_json())
    else:
        print("", *summary(result, story, case.description, directory.path), sep="\n")
    if directory.missing:
        words = f"the record in {str(directory.path)!r} is incomplete: {directory.missing}"
        print(f"homeostat: {printable(words)}", file=sys.stderr)
    return STATUS[result.outcome] if directory.keeps(RESULT) else NOT_STORED


def _view(case: Case, chosen: Scenario, as_json: bool) -> View:
    """A terminal is shown the run live; a pipe gets lines; with JSON, standard output stays free."""
    from homeostat.cli.views import PlainView, SilentView

    stream = sys.stderr if as_json else sys.stdout
    if stream.isatty():
        from homeostat.cli.terminal import TerminalView

        first = dict.fromkeys(panel.tags[0] for panel in case.panels)
        return TerminalView(stream, chosen.end_s, [case.description.tag(tag) for tag in list(first)[:2]])
    return SilentView() if as_json else PlainView(stream)
