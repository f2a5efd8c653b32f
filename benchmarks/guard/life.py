"""A simulated plant that outlives the guards beside it, each of which may die at any instant and leaves a journal."""

from __future__ import annotations

import contextlib
import os
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from homeostat.domain.mode import Mode
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.ports import GuardEvent
from homeostat.domain.recovery import Command
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Journal, Record, read_events
from homeostat.journal.beside.files import JOURNAL
from homeostat.links.simulated import SimulatedLink, SimulatedWire

KEY = b"k" * 32
SETTINGS = GuardSettings(sync_s=5.0)


class Killed(BaseException):
    """The process dies here."""


@dataclass
class Death:
    """Counts the instants at which a process may die, and says at which one it does."""

    at: int = 0
    instants: int = 0
    dead: bool = False
    place: str = ""
    places: list[str] = field(default_factory=list)

    def instant(self, place: str) -> None:
        """The process may die here; once it is dead nothing that it does has an effect any more."""
        if not self.dead:
            self.instants += 1
            if self.at == 0:
                self.places.append(place)
            if self.instants == self.at:
                self.dead, self.place = True, place
        if self.dead:
            raise Killed


class DeadlyJournal:
    """A journal whose process may die around every line and every sync."""

    def __init__(self, journal: Journal, death: Death, synced: int) -> None:
        self._journal, self._death = journal, death
        self.synced = synced

    def record(self, event: GuardEvent, at_s: float) -> None:
        self._death.instant(f"before {event.kind}")
        self._journal.record(event, at_s)
        self._death.instant(f"after {event.kind}")

    def sync(self) -> None:
        self._death.instant("before a sync")
        self._journal.sync()
        self.synced = (self._journal.directory / JOURNAL).stat().st_size
        self._death.instant("after a sync")


class DeadlyLease:
    """The way to the plant; the guard may die before, inside and after each use of it."""

    never_blocks = True

    def __init__(self, link: SimulatedLink, death: Death) -> None:
        self._link, self._death = link, death
        self._wire: SimulatedWire | None = None

    def take(self) -> DeadlyLease:
        self._death.instant("before the lease")
        self._wire = self._link.take()
        return self

    def beat(self) -> None:
        self._death.instant("before the heartbeat")
        self._link.beat()

    def give_back(self) -> None:
        self._death.instant("before the lease is given back")
        self._link.give_back()

    def send(self, commands: tuple[Command, ...]) -> Any:
        assert self._wire is not None
        self._death.instant("before a write")
        if self._death.instants + 1 == self._death.at:
            self._wire.send(commands[: (len(commands) + 1) // 2])
        self._death.instant("inside a write")
        ticket = self._wire.send(commands)
        self._death.instant("after a write")
        return ticket


class Life:
    """One plant, its journal, and the guards that live and die beside it."""

    def __init__(self, rules: GuardRules, link: SimulatedLink, folder: Path, draw: random.Random) -> None:
        self.rules, self.link, self.folder, self._draw = rules, link, folder / "run", draw
        self.deaths: list[str] = []
        self.synced: list[bytes] = []
        """What was synced at each death; it must be there at the end."""

    def begin(self, death: Death) -> None:
        """A new guard on the same plant, with what the journal says."""
        self.death = death
        memory = Memory.of(list(read_events(self.folder))) if self.deaths else None
        self._journal = Journal.resume(self.folder) if self.deaths else Journal(self.folder)
        self._record = DeadlyJournal(self._journal, death, len(self.synced[-1]) if self.synced else 0)
        attachment = Attachment(
            self._record, DeadlyLease(self.link, death), Mode.CLOSED_LOOP, {"check": KEY}, memory=memory
        )  # fmt: skip
        self.guard = Guard(self.rules, attachment, SETTINGS)

    def run(self, act: Callable[[Life, float], None], deaths: list[Death]) -> None:
        """To the end of the plant's run, with so many guards; ``act`` does what people and recovery do."""
        later, gap_s = list(deaths), 0
        self.begin(later.pop(0))
        while not self.link.ended:
            sample = self.link.advance()
            if gap_s > 0:
                gap_s -= 1
                if gap_s == 0:
                    self.begin(later.pop(0) if later else Death())
                continue
            try:
                act(self, self.link.now_s)
                self.death.instant("between ticks")
                self.guard.tick(self.link.now_s, sample)
                if self.death.dead:  # the thread of the journal has died
                    raise Killed
            except Killed:
                self._die()
                gap_s = self._draw.randint(1, 8)
        if gap_s == 0:
            self.death.at = 0
            self.guard.stop("the run is over")
        with contextlib.suppress(ValueError):
            self._journal.__exit__(None, None, None)

    def events(self) -> list[Record]:
        """The journal; BrokenChain where it does not verify."""
        return list(read_events(self.folder))

    def _die(self) -> None:
        """Only what was synced is sure to be left; what comes after it may be there, in part, or be torn."""
        self.guard._parts.recorder.close()
        self._journal.__exit__(None, None, None)
        path, record = self.folder / JOURNAL, self._record
        size = path.stat().st_size
        left = self._draw.choice([record.synced, size, self._draw.randint(record.synced, size)])
        os.truncate(path, left)
        self.synced.append(path.read_bytes()[: record.synced])
        self.deaths.append(self.death.place)
