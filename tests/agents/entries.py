"""Entries of a playbook of the reactor, as tests need them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from homeostat import __version__
from homeostat.agents.playbook.book import Book
from homeostat.agents.roles import Situation
from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.playbook import Answer, Entry, Margin, Occasion, Setpoint
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from tests.twin.followed import reactor

STANDS = {"F1.sp": 1 / 30, "L1.sp": 10.0, "T1.sp": 310.0, "V2.man": None}
COMMANDS = (
    Command("F1.sp", 0.0205, 0.005), Command("L1.sp", 10.0, 0.1), Command("T1.sp", 310.0, 0.5),
    Command("V2.man", None, None), Command("XV1.cmd", 1.0, 0.05),
)  # fmt: skip
ANSWER = Answer(
    ("normal", "reduced_load"), COMMANDS, "reduced_load", (), "search", Margin("ACC-T-HIGH", 0.4, "K"), 0.39,
    Certificate(512, 0, 0.008, 0.96),
)  # fmt: skip


def stuck(size: float = 0.7, probability: float = 1.0, onset_s: float = 900.0) -> Hypothesis:
    return Hypothesis((FaultState("cool_stuck_closed", size, onset_s),), probability)


def occasion(*hypotheses: Hypothesis, state: str = "normal", **setpoints: float | None) -> Occasion:
    """With ``setpoints`` by the name of their tag, its dot an underscore, elsewhere than by design."""
    stands = STANDS | {name.replace("_", "."): value for name, value in setpoints.items()}
    return Occasion(state, "closed-loop", hypotheses or (stuck(),), tuple(Setpoint(*each) for each in stands.items()))


def entry(*hypotheses: Hypothesis, **more: Any) -> Entry:
    """The reactor's with a stuck valve; ``more`` replaces fields of it."""
    made = Entry(reactor().configuration, __version__, "a test", occasion(*hypotheses), ANSWER)
    return replace(made, **more)


def moved(rate: float) -> Answer:
    """The answer with another feed [L/s]."""
    return replace(ANSWER, commands=(replace(COMMANDS[0], value=rate), *COMMANDS[1:]))


def book(*entries: Entry) -> Book:
    return Book(entries, reactor().description)


def situation(*hypotheses: Hypothesis, state: str = "normal") -> Situation:
    """A reactor by design in ``state``, of which that is held to be wrong."""
    values = {tag: math.nan if value is None else value for tag, value in STANDS.items()} | {"T1": 310.0, "L1": 10.0}
    return Situation(Snapshot(1000.0, values), Diagnosis(1000.0, (), hypotheses or (stuck(),)), state)
