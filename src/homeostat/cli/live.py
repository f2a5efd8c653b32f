"""A run that is shown on a page while it goes on."""

import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import Final, final

from homeostat.cli.commands.console import known_plant
from homeostat.cli.giving import ANSWER_S
from homeostat.cli.serving import giver, serving
from homeostat.console.opened import OpenedRun
from homeostat.console.people.orders import Came, Give, Objection
from homeostat.console.people.people import People
from homeostat.console.readings import Gathered
from homeostat.console.server.app import application
from homeostat.console.server.serve import listening, serve
from homeostat.domain.mode import PersonCommand
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.operation import Operation
from homeostat.plants.plant import Plant
from homeostat.recovery.exchange.pacing import Pacing

LONGEST_S: Final = 150.0
"""Longest wait for an answer in real time, wall-clock [s]."""


@final
class LivePage:
    """The page of one run, served by a thread of this process on a free port; whoever looks never holds the run up."""

    def __init__(self, plant: Plant, run_dir: Path, people: People | None, operation: Operation) -> None:
        """Serve the page of the run that is about to begin in ``run_dir``; a terminal gets a browser, too.

        ``people`` may look and order; where there are none, whoever is on this machine looks. The run waits for
        the pacing of ``operation``, which the page may change; it has none in real time.
        """
        pacing = operation.pacing
        self._gathered, self._pacing = Gathered(tag.name for tag in plant.description.tags), pacing
        run = OpenedRun(run_dir, known_plant(plant), self._gathered, pacing=pacing)
        served = serving(people, run_dir, True)
        if served.give is not None and pacing is not None:
            served = replace(served, give=unless_paused(served.give, pacing))
        elif served.give is not None:
            served = replace(served, give=giver(run_dir, answer_s(plant.description.timing.tick_s, operation.pace)))
        self._app, self._at = application(run, served), listening(0)
        threading.Thread(target=self._serve, daemon=True).start()

    def see(self, snapshot: Snapshot) -> None:
        """Take what the plant says now."""
        self._gathered(snapshot)

    def stay(self) -> None:
        """Serve until Ctrl-C."""
        print("homeostat: the page stays until Ctrl-C", file=sys.stderr, flush=True)
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            return

    def _serve(self) -> None:
        try:
            serve(self._app, self._at, sys.stdout.isatty(), _tell)
        finally:  # a run that stands would stand for ever
            if self._pacing is not None and self._pacing.now is not None:
                self._pacing.go_on()
                _say("the page is closed, and the run goes on without it")


def unless_paused(give: Give, pacing: Pacing) -> Give:
    """``give``, but for a run that stands: its guard would hear nothing, and the order would come to nothing."""

    def given(command: PersonCommand) -> Came:
        pace = pacing.now
        if pace is not None and pace.paused:
            raise Objection("busy", "the run is paused, and its guard hears nothing; let it go on, and order it then")
        with pacing.answering():
            return give(command)

    return given


def answer_s(tick_s: float, pace: float | None) -> float:
    """How long an answer is waited for in real time [s]: the guard hears an order at the second tick after it.

    >>> answer_s(1.0, 10.0), answer_s(60.0, 10.0)
    (10.2, 22.0)
    """
    return min(ANSWER_S + 2.0 * tick_s / (pace or 1.0), LONGEST_S)


def _tell(address: str) -> None:
    _say(f"the run is shown at {address}")


def _say(text: str) -> None:
    print(f"homeostat: {text}", file=sys.stderr, flush=True)
