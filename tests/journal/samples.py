"""Events for the tests of the trace, and runs made of them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, StrEnum
from pathlib import Path
from typing import ClassVar

from homeostat.journal import Journal, Manifest, RunFinished, RunStarted, Setting, Summary
from homeostat.journal.beside.artifacts import write_text


class Health(StrEnum):
    GOOD = "good signal"
    BAD = "bad signal"


class Result(Enum):
    TRIPPED = "The twin reached an interlock."


@dataclass(frozen=True, slots=True)
class Margin:
    criterion: str
    value: float


@dataclass(frozen=True, slots=True)
class Measured:
    kind: ClassVar[str] = "measured"

    tag: str
    value: float
    health: Health = Health.GOOD
    margins: tuple[Margin, ...] = ()
    wall_latency_s: float = 0.0


def write_run(directory: Path, events: int = 6, wall_latency_s: float = 0.0) -> Manifest:
    """A closed run with a query beside it; ``events`` measurements between its start and its end."""
    with Journal(directory) as journal:
        record_run(journal, events, wall_latency_s)
        write_text(directory / "queries", "ASK { ?valve ?stuck true }\n", ".rq")
        return journal.close(Summary(seed=7, outcome="released"))


def write_open_run(directory: Path, events: int = 6) -> None:
    """The same run, left before it was closed."""
    with Journal(directory) as journal:
        record_run(journal, events)


def record_run(journal: Journal, events: int, wall_latency_s: float = 0.0) -> None:
    journal.record(RunStarted("cstr", ("cool_stuck_closed",), 7, (Setting("members", 64),)), 0.0)
    for number in range(events):
        margins = (Margin("temperature", 1.5 - number), Margin("level", float("inf")))
        journal.record(Measured("T1", 300.0 + number / 3, Health.GOOD, margins, wall_latency_s), 0.5 * number)
    journal.record(RunFinished("released"), 0.5 * events)
