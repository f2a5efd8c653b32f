"""The vessel, guarded in real time behind its doors, with a journal on the disk: what a console is served from."""

from __future__ import annotations

import contextlib
import os
import pwd
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from homeostat.domain.diagnosis import FaultState, Hypothesis, Symptom
from homeostat.domain.events.recovery import Attempted, Diagnosed, LaterStep, Noticed
from homeostat.domain.mode import Mode
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.verdict import Finding, Owner
from homeostat.guard.requests.seal import Sealer
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Journal
from homeostat.journal.beside.files import JOURNAL
from homeostat.journal.found import Found
from homeostat.service.attached.place import RECALLED, first_event
from homeostat.service.attached.status import StatusBoard
from homeostat.service.doors.door import Behind, Doors
from homeostat.service.order import run_identity
from tests.guard.vessel import KEY, World

TICK_S = 0.05
"""Wall-clock time from tick to tick [s]: a second of the vessel's."""
PERSON_S = 3600.0
"""How long a yes is waited for [s]: 3 min of a page on a busy host."""


@dataclass
class _Connected:
    trouble: str = ""
    connections: int = 1
    clock_s: float = 0.0


class Attended:
    """A guard that goes on in a thread; people reach it at its doors."""

    def __init__(self, folder: Path, mode: Mode = Mode.APPROVE, believed: bool = True, **settings: Any) -> None:
        """``believed``: whether names from this login count as people, as those of its console do."""
        folder.mkdir(parents=True, exist_ok=True)
        self.directory, self._lock, self._proposed = folder, threading.Lock(), 0
        begun = (folder / JOURNAL).exists()
        records = Found.in_directory(folder, kinds=RECALLED).records if begun else ()
        self._open = contextlib.ExitStack()
        self.journal = self._open.enter_context(Journal.resume(folder) if begun else Journal(folder))
        if not begun:
            self.journal.record(first_event("vessel", (), "2026-01-01T00:00:00+00:00", ()), 0.0)
        self.world = World(
            mode=mode,
            settings=GuardSettings(**{"persons": 2, "sync_s": 5.0, "person_s": PERSON_S, **settings}),
            record=self.journal,
            memory=Memory.of(records) if records else None,
            goes_on=False,
        )
        if records:
            self.world.vessel.now_s = float(int(records[-1].at_s)) + 1.0
        guard, person_s = self.world.guard, settings.get("person_s", PERSON_S)
        self._sealer = Sealer("check", KEY, lambda: person_s)
        board = StatusBoard(guard, _Connected(), lambda: 0, {"plant": "vessel", "configuration": "c" * 64})
        board.recall(records)
        own = frozenset((pwd.getpwuid(os.getuid()).pw_name,)) if believed else frozenset()
        self.journal.subscribe(board.follow)
        self.doors = Doors(
            folder, Behind(guard.mailbox.put, board.told, run_identity(folder)), {}, own if believed else frozenset()
        )
        self.journal.subscribe(self.doors.follow)
        self._board, self._ending = board, threading.Event()
        for _ in range(6):  # start-up is over
            board.show(self.world.tick())
        self._thread = threading.Thread(target=self._go_on, daemon=True)
        self._thread.start()

    def propose(self, target_K: float = 305.0, *then: Step) -> tuple[str, ActionSet]:
        """Have recovery propose something, as it would, with what is to follow; the request and what it is to write."""
        self._proposed += 1
        name = f"r{self._proposed}-{os.getpid()}-{time.monotonic_ns()}"
        actions = ActionSet((Command("T.sp", target_K, 0.5), Command("F.sp", 0.02, 0.005)), "running", then)
        with self._lock:
            at_s, record = self.world.vessel.now_s, self.journal.record
            record(Noticed(("S-HOT",)), at_s)
            symptom = Symptom("S-HOT", at_s, 2.0, 1.0, 3.0)
            record(Diagnosed((symptom,), (Hypothesis((FaultState("valve_stuck", 0.5, at_s),), 0.9),)), at_s)
            found = Finding("LIM-HOT", Owner.ACTION, 1.5, "K", 120.0, 3, "T stays below 313 K")
            path = ("running", "running", *(s.target for s in then))
            later = LaterStep.all_of(actions)
            told = Attempted(1, "search", path, actions.commands, actions.digest, True, (found,), 24, then=later)
            record(told, at_s)
            way = ("adjust", *(s.transition.name for s in then))
            self.world.ask(self._sealer.seal(self.world.request(name, actions, path=way), at_s))
        return name, actions

    def tick(self, **values: float) -> None:
        """Change some readings for good."""
        with self._lock:
            self.world.vessel.values.update(values)

    @property
    def sent(self) -> list[tuple[Command, ...]]:
        """What arrived on the vessel's wire."""
        with self._lock:
            return self.world.sent

    def close(self) -> None:
        """End the service; the journal stays."""
        self._ending.set()
        self._thread.join(10.0)
        self.doors.close()
        self._open.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def _go_on(self) -> None:
        while not self._ending.wait(TICK_S):
            with self._lock, contextlib.suppress(ValueError):
                self._board.show(self.world.tick())
