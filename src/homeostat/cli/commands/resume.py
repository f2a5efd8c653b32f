"""``homeostat resume``: a run that was killed goes on from its journal."""

import argparse
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, Self

from homeostat.agents.playbook.book import Book
from homeostat.agents.roles import AskingProtocol
from homeostat.cli.arguments import UsageError
from homeostat.cli.commands.run import Going, carry
from homeostat.cli.operation import orders_to, paced
from homeostat.cli.run_directory import run_directory
from homeostat.domain.mode import Mode
from homeostat.evaluate.beginning import watched
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.operation import Operation, Thinking, declared
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


class Chosen(NamedTuple):
    """What a run was begun with, but for its scenario."""

    proposer: str
    """Who was to propose."""
    protocol: str
    """When it was to be asked."""
    conditions: Conditions
    """How agents are asked, and what they are told."""
    budget: Budget
    """How long a recovery may think."""
    thinking: Thinking
    """What thinking costs."""
    mode: Mode
    """Mode of the guard at the start."""
    persons: int
    """How many people have to approve."""
    pace: float | None
    """Process seconds per second in real time; None in virtual time."""

    @classmethod
    def of(cls, past: Past) -> Self:
        """As the first event of ``past`` says; ResumptionError where it does not, as one of another version."""
        said = past.started.settings
        label_given, reprompting, ensemble = (
            bool(said.get(name, usual))
            for name, usual in (("label_given", False), ("reprompting", True), ("ensemble", True))
        )
        try:
            thinks = "thinking_declared_s" in said
            return cls(
                str(said["proposer"]),
                str(said["protocol"]),
                Conditions(label_given=label_given, reprompting=reprompting, ensemble=ensemble),
                Budget(latency_s=float(said["budget_s"])) if "budget_s" in said else Budget(),
                declared(float(said["thinking_declared_s"])) if thinks else Thinking(float(said["thinking_scale"])),
                Mode(str(said.get("mode", Mode.CLOSED_LOOP))),
                int(said.get("persons", 1)),
                float(said["pace"]) if "pace" in said else None,
            )
        except (KeyError, ValueError) as error:
            raise ResumptionError(f"its first event does not say {error}; use the version that recorded it") from None


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
        chosen = Chosen.of(past)
        book = _playbook(past, run_dir, plant)
        if chosen.protocol != AskingProtocol.ROUTE.value:
            raise ResumptionError("it was asked for step by step, and what was asked is not in its journal")
    except (PlantError, ResumptionError) as reason:
        raise ResumptionError(f"run {str(run_dir)!r} cannot go on: {reason}") from None
    path = run_dir if options.out is None else _copied(run_dir, options.out)
    directory = RunDirectory.resume(path)
    for line in told(past):
        print(f"homeostat: {line}", file=sys.stderr)
    if chosen.proposer != "search":
        print(f"homeostat: it goes on with the search alone, without {chosen.proposer!r}", file=sys.stderr)
    if book is not None:
        print("homeostat: it goes on with the playbook that it began with; nothing is added to it", file=sys.stderr)
    operation = _operation(past, chosen, directory.path, options.pace)
    thinking = Thinking(operation.pace or chosen.thinking.scale, chosen.thinking.declared_s)
    proposing = Proposing(None, chosen.conditions, budget=chosen.budget, playbook=book)
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


def _operation(past: Past, chosen: Chosen, run_dir: Path, pace: float | None) -> Operation:
    operation = Operation(chosen.mode, persons=chosen.persons, past=past)
    if chosen.pace is not None:  # in real time
        return replace(operation, pace=pace or chosen.pace, orders=orders_to(run_dir))
    return operation if pace is None else paced(operation, pace, run_dir)
