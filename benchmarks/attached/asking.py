"""Thinking as a script: it asks for a setpoint that was never asked for before whenever the guard would write it."""

from __future__ import annotations

import itertools
import threading
from dataclasses import replace
from pathlib import Path
from typing import Final, final

from benchmarks.attached.tank import MACHINE, RULES
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.request import Request, Seal
from homeostat.guard.requests.seal import Sealer
from homeostat.plants.wired.guarding import ISSUER
from homeostat.service.attached.place import THINKING
from homeostat.service.thinking.away import Away
from homeostat.service.thinking.codec import Hello

EVERY_S: Final = 2.0
"""How often it asks, in process time [s]."""
STEP: Final = 1e-5
"""By how much a setpoint differs from every earlier one [L]."""


@final
class Asking:
    """Asks in a thread, over the guard's socket, for ``L.sp`` at about 7 and 10 L in turns."""

    def __init__(self, directory: Path) -> None:
        self._on, self._asked_s = True, 0.0
        self._numbers = itertools.count(1)
        self.asked = 0
        """Number of the last request; it is in the value that it asks for."""
        self._away = Away(directory / THINKING, MACHINE, lambda: self._on)
        threading.Thread(target=self._listen, name="asking", daemon=True).start()

    def end(self) -> None:
        """Ask no more."""
        self._on = False

    def _listen(self) -> None:
        sealer: Sealer | None = None
        for told in self._away.told():
            if isinstance(told, Hello):
                sealer = Sealer(ISSUER, told.key)
                self._away.ready()
            elif sealer is not None:
                self._ask(told, sealer)

    def _ask(self, seen: Observation, sealer: Sealer) -> None:
        due = not 0.0 <= seen.now_s - self._asked_s < EVERY_S
        if not self._on or seen.mode is not Mode.CLOSED_LOOP or seen.state != "running" or not due:
            return
        self._asked_s, self.asked = seen.now_s, next(self._numbers)
        actions = ActionSet((Command("L.sp", value(self.asked), 2.0),), "running")
        plain = Request(
            f"ask-{self.asked}", "script", "running", actions, ("adjust",), "", RULES.configuration,
            Seal("", 0.0, 0.0, "", ""),
        )  # fmt: skip
        self._away.send(sealer.seal(replace(plain), seen.now_s))


def value(number: int) -> float:
    """The setpoint of request ``number`` [L]."""
    return round((7.0 if number % 2 else 10.0) + STEP * number, 6)


def number_of(setpoint: float) -> int:
    """The request that ``setpoint`` is of."""
    return round((setpoint - (7.0 if setpoint < 8.5 else 10.0)) / STEP)
