"""``homeostat playbook``: filled offline, and shown as a person reads it."""

import argparse
import sys

from homeostat.cli.table import show_table
from homeostat.domain.certificate import Certificate
from homeostat.domain.playbook import Answer, Entry
from homeostat.domain.quotation import printable
from homeostat.evaluate.playbook.building import Answered, Hands, build, left_of
from homeostat.evaluate.playbook.points import questions
from homeostat.plants.plant import load_plant
from homeostat.record.playbook import PlaybookError, read_playbook

FAILED = 1
"""Exit status where a question could not be worked on, or what is shown is no entry."""
HEADS = ("situation", "action", "cost", "margin", "outcome")
"""Columns of the table."""
DIGITS = 12
"""Digits by which a configuration is named."""


def carry_out(options: argparse.Namespace) -> int:
    """Build; 1 where a question could not be worked on. What has no answer is told, and is none."""
    plant = load_plant(options.case)
    asked = questions(plant, _names(options.faults), int(options.severities), _names(options.states), options.seed)
    left = left_of(plant, asked, options.out)
    print(f"{len(asked)} situations, {len(asked) - len(left)} of them in {printable(str(options.out))} already")
    count = 0

    def show(done: Answered) -> None:
        nonlocal count
        count += 1
        print(f"{count} of {len(left)}: {printable(_told(done))}", flush=True)

    done = build(plant, left, options.out, Hands(int(options.jobs), options.cluster), show)
    failed = [one for one in done if one.entry is None]
    for one in failed:
        print(f"homeostat: {printable(f'{one.question.source} failed: {one.failure}')}", file=sys.stderr)
    if failed:
        print(f"homeostat: {len(failed)} of {len(left)} failed; start again to retry them", file=sys.stderr)
    entries = [one.entry for one in done if one.entry is not None]
    answers, lacking = sum(e.answer is not None for e in entries), sum(e.answer is None and e.needed for e in entries)
    idle = len(entries) - answers - lacking
    print(f"{answers} answers; {lacking} without an answer, where the fallback acts; {idle} where nothing need be done")
    return FAILED if failed else 0


def _names(given: list[str] | None) -> list[str]:
    return [name for text in given or () for name in text.split(",") if name]


def _told(done: Answered) -> str:
    what = f"{done.question.fault} {done.question.severity:g} in {done.question.state}"
    if done.entry is None:
        return f"{what}: failed: {done.failure}"
    return f"{what}: {done.entry.reason if done.entry.answer is None else _action(done.entry.answer)}"


def show(options: argparse.Namespace) -> int:
    """Print the entries as a table, by configuration; 1 where the file holds anything that is no entry."""
    if not options.file.exists():
        raise PlaybookError(f"there is no playbook {str(options.file)!r}; 'homeostat playbook build' makes one")
    content = read_playbook(options.file)
    by_configuration: dict[str, list[Entry]] = {}
    for entry in content.entries:
        by_configuration.setdefault(entry.configuration, []).append(entry)
    for configuration, entries in by_configuration.items():
        print(f"configuration {printable(configuration[:DIGITS])}, {len(entries)} entries")
        show_table(HEADS, [_row(entry) for entry in entries], indent=2)
    for trouble in content.troubles:
        print(f"homeostat: {printable(trouble)}", file=sys.stderr)
    return FAILED if content.troubles else 0


def _row(entry: Entry) -> tuple[str, str, str, str, str]:
    answer = entry.answer
    if answer is None:
        return _situation(entry), entry.reason, "", "", entry.source
    worst, bound = answer.worst, answer.certificate
    margin = "" if worst is None else f"{worst.amount:+.3g} {_unit(worst.unit)}({worst.criterion})"
    certified = "" if bound is None else f", at most {bound.bound:.2g} {_counted(bound)}"
    return _situation(entry), _action(answer), f"{answer.cost_share:.1%}", margin + certified, _outcome(entry)


def _counted(bound: Certificate) -> str:
    return "do worse than the fallback" if bound.beside else "violate"


def _situation(entry: Entry) -> str:
    """The likeliest explanation of each set of faults, in short."""
    sizes: dict[str, tuple[float, str]] = {}
    for h in entry.occasion.hypotheses:
        said = " and ".join(f"{f.fault} {f.severity:.3g}" for f in h.faults) or "no fault"
        before, text = sizes.get(h.name, (0.0, said))
        sizes[h.name] = before + h.probability, text
    every = ", ".join(text if p > 0.995 else f"{p:.0%} {text}" for p, text in sizes.values())
    return f"{entry.occasion.state}: {every or 'no fault'}"


def _action(answer: Answer) -> str:
    """A route by its states, whose commands are mostly those of the tables; anything else by what is commanded."""
    if answer.then:
        return f"{' > '.join(answer.path[1:])} (by {answer.proposer})"
    commands = ", ".join(f"{c.tag} {'automatic' if c.value is None else f'{c.value:.4g}'}" for c in answer.commands)
    return f"{' > '.join(answer.path[1:])}: {commands} (by {answer.proposer})"


def _outcome(entry: Entry) -> str:
    after = entry.aftermath
    if after is None:
        return f"never released; {entry.source}"
    worst = None if entry.answer is None else entry.answer.worst
    read = "" if after.kept is None or worst is None else f", {after.kept:+.3g} {_unit(worst.unit)}read"
    return f"{after.ending.value} {after.seconds:.0f} s{read}; {entry.source}"


def _unit(unit: str) -> str:
    return "" if unit == "1" else f"{unit} "
