"""``homeostat resume``: a run that was killed goes on from its journal."""

import argparse
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from homeostat.agents.playbook.book import Book
from homeostat.agents.roles import AskingProtocol
from homeostat.cli.arguments import UsageError
from homeostat.cli.commands.run import Going, carry
from homeostat.cli.operation import orders_to, paced
from homeostat.cli.run_directory import run_directory
from homeostat.domain.mode import Mode
from homeostat.evaluate.beginning import watched
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.recorded.plant import recorded_plant_of
from homeostat.evaluate.recorded.resumption import Past, ResumptionError, told
from homeostat.journal import read_events
from homeostat.journal.beside.files import MANIFEST, RESULT
from homeostat.plants.error import PlantError
from homeostat.plants.plant import Plant
from homeostat.plants.wired.playbook import NAME as PLAYBOOK
from homeostat.plants.wired.playbook import open_playbook
from homeostat.record.directory import RunDirectory, RunDirectoryError
from homeostat.recovery.bounds import Budget
from homeostat.service.inbox import INBOX


def carry_out(options: argparse.Namespace) -> int:
    """Check everything, go on, show, keep; the exit status says what happened."""
    run_dir = run_directory(options.run)
    if (run_dir / MANIFEST).exists() or (run_dir / RESULT).exists():
        raise UsageError(f"run {str(run_dir)!r} is over; begin another one")
    try:
        past = Past.of(tuple(read_events(run_dir)))
        designed = recorded_plant_of(past.started, options.case)
        scenario = past.scenario(designed)
        plant = watched(designed, scenario)
        chosen = past.started.settings
        book = _playbook(past, run_dir, plant)
        if chosen.get("protocol") != AskingProtocol.ROUTE.value:
            raise ResumptionError("it was asked for step by step, and what was asked is not in its journal")
    except (PlantError, ResumptionError) as reason:
        raise ResumptionError(f"run {str(run_dir)!r} cannot go on: {reason}") from None
    path = run_dir if options.out is None else _copied(run_dir, options.out)
    directory = RunDirectory.resume(path)
    for line in told(past):
        print(f"homeostat: {line}", file=sys.stderr)
    if chosen["proposer"] != "search":
        print(f"homeostat: it goes on with the search alone, without {chosen['proposer']!r}", file=sys.stderr)
    if book is not None:
        print("homeostat: it goes on with the playbook that it began with; nothing is added to it", file=sys.stderr)
    reprompting, ensemble = (bool(chosen.get(name, True)) for name in ("reprompting", "ensemble"))
    conditions = Conditions(label_given=bool(chosen.get("label_given")), reprompting=reprompting, ensemble=ensemble)
    operation = _operation(past, directory.path, options.pace)
    thinking = _thinking(past, operation)
    budget = Budget(latency_s=float(chosen["budget_s"])) if "budget_s" in chosen else Budget()
    proposing = Proposing(None, conditions, budget=budget, playbook=book)
    going = Going(plant, scenario, directory, thinking, "search", proposing, operation)
    return carry(going, options.json)


def _copied(run_dir: Path, out: Path) -> Path:
    """``out``, with all that the run has left but what people put into its inbox."""
    if out.exists():
        raise RunDirectoryError(f"{str(out)!r} exists; choose another directory or remove it first")
    shutil.copytree(run_dir, out, ignore=shutil.ignore_patterns(INBOX))
    return out


def _playbook(past: Past, run_dir: Path, plant: Plant) -> Book | None:
    """The playbook that the run began with, of which it has kept a copy; where its own file is, nobody knows."""
    if (began := past.started.settings.get("playbook")) is None:
        return None
    book, content = open_playbook(run_dir / PLAYBOOK, plant)
    if content.sha256 != began:
        raise ResumptionError(f"{PLAYBOOK!r} in it is not the playbook that it began with; restore it")
    return book


def _thinking(past: Past, operation: Operation) -> Thinking:
    chosen = past.started.settings
    if "thinking_declared_s" in chosen:
        return Thinking(declared_s=float(chosen["thinking_declared_s"]))
    return Thinking(operation.pace or float(chosen["thinking_scale"]))


def _operation(past: Past, run_dir: Path, pace: float | None) -> Operation:
    chosen = past.started.settings
    mode, persons = Mode(str(chosen.get("mode", Mode.CLOSED_LOOP))), int(chosen.get("persons", 1))
    operation = Operation(mode, persons=persons, past=past)
    if "pace" in chosen:  # in real time
        return replace(operation, pace=pace or float(chosen["pace"]), orders=orders_to(run_dir))
    return operation if pace is None else paced(operation, pace, run_dir)
