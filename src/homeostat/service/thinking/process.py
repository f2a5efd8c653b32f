"""The process that thinks: recovery with twin and models, told by a guard in another process what it sees."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from homeostat.agents.roles import AskingProtocol
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation, Trouble
from homeostat.guard.requests.seal import Sealer
from homeostat.guard.settings import GuardSettings
from homeostat.links.clock import ThinkingClock
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import BUSY_S, Arrangement, Outside, recovery_beside
from homeostat.plants.wired.guarding import ISSUER
from homeostat.record.texts import Texts
from homeostat.recovery.bounds import Budget
from homeostat.recovery.exchange.exchange import Exchange
from homeostat.recovery.exchange.loop import overtaken_by
from homeostat.service.attached.place import THINKING, begins
from homeostat.service.thinking.away import Away, AwayTrace
from homeostat.service.thinking.codec import FromThinking, Hello
from homeostat.service.thinking.consulted import BUDGET_S, Consulted
from homeostat.service.thinking.consulting import Prepared, prepared
from homeostat.service.thinking.learning import Learning

PULSE_S: Final = 1.0
"""How often it says that it goes on, wall-clock [s]."""
LOST: Final = 1
"""Exit status of thinking that failed for good, or may not think for this guard."""


@dataclass(frozen=True, slots=True)
class Thinking:
    """What a process thinks about."""

    directory: Path
    """Directory of the attached plant."""
    plant: str
    """Name of the plant, or path of its folder."""
    pace: float
    """Process seconds per wall-clock second."""
    pulse: int
    """Descriptor that takes a byte each time it says that it goes on."""
    parent: int
    """Number of the process that started it: it may be gone before this one has loaded anything."""
    consulted: Consulted
    """Who proposes, and what is known from before."""

    @property
    def budget(self) -> Budget:
        """What one recovery may take."""
        return Budget(latency_s=self.consulted.budget_s)

    @property
    def busy_s(self) -> float:
        """Longest that recovery may look at nothing else, wall-clock [s]: longer where it is to think for longer."""
        return BUSY_S + max(self.consulted.budget_s - BUDGET_S, 0.0) / self.pace


class _Heart:
    """Says from a thread of its own that this process goes on, as long as recovery looks up now and then."""

    def __init__(self, pulse: int, parent: int, busy_s: float) -> None:
        self._pulse, self._parent, self._busy_s = pulse, parent, busy_s
        self.exchange: Exchange | None = None
        threading.Thread(target=self._beat_on, name="pulse", daemon=True).start()

    @property
    def goes_on(self) -> bool:
        """Whether whoever started this process is still there."""
        return os.getppid() == self._parent

    def _beat_on(self) -> None:
        while True:
            if not self.goes_on:
                os._exit(0)
            if self.exchange is None or self.exchange.busy_s < self._busy_s:
                with contextlib.suppress(OSError):
                    os.write(self._pulse, b".")
            time.sleep(PULSE_S)


class _Seen:
    """The last tick that the guard told of."""

    def __init__(self, tick_s: float) -> None:
        self.last: Observation | None = None
        self._settings = GuardSettings().for_ticks(tick_s)

    @property
    def seal_s(self) -> float:
        """How long a seal holds at present [s]."""
        asks = self.last is not None and self.last.mode is Mode.APPROVE
        return self._settings.person_s if asks else self._settings.check_age_s


def think(thinking: Thinking) -> None:
    """Think until whoever started this process is gone; ends the process itself where it cannot go on."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C at the terminal is for whoever started this
    heart = _Heart(thinking.pulse, thinking.parent, thinking.busy_s)
    plant = load_plant(thinking.plant)
    away = Away(thinking.directory / THINKING, plant.description.machine, lambda: heart.goes_on)
    seen, begun = _Seen(plant.description.timing.tick_s), None
    for told in away.told():
        if isinstance(told, Hello):
            if told.configuration != plant.configuration:
                _give_up(away, f"the plant in {str(plant.files.folder)!r} has changed since it was attached")
            if begun is None:
                begun = _begin(thinking, plant, told.key, away, seen)
                heart.exchange = begun.exchange
                away.ready(begun.playbook)
            for trouble in begun.troubles:  # a guard that has begun again knows of none
                away.send(trouble)
        elif begun is not None and (seen.last is None or told.now_s > seen.last.now_s):
            before, seen.last = seen.last, told
            if begun.learning is not None:
                begun.learning.see(told)
            begun.exchange.publish(told, None if before is None else overtaken_by(before, told))


@dataclass(frozen=True, slots=True)
class _Begun:
    """Recovery that goes on in its thread."""

    exchange: Exchange
    """Where observations are put."""
    lasting: tuple[Trouble, ...]
    """What could not be had when it began."""
    playbook: str
    """Digest of the playbook that it began with; empty for none."""
    learning: Learning | None
    """What its releases leave in the playbook; None where there is none."""

    @property
    def troubles(self) -> tuple[Trouble, ...]:
        """What is wrong beside the guard at present."""
        trouble = None if self.learning is None else self.learning.writing.trouble
        return self.lasting if trouble is None else (*self.lasting, trouble)


def _begin(thinking: Thinking, plant: Plant, key: bytes, away: Away, seen: _Seen) -> _Begun:
    """Have recovery begin in its thread."""

    def send(said: FromThinking) -> None:
        away.send(said)
        if isinstance(said, Trouble) and said.name == "recovery:lost":
            _give_up(away, said.cause)

    sealer = Sealer(ISSUER, key, lambda: seen.seal_s)
    outside = Outside(send, ThinkingClock(thinking.pace), AwayTrace(send), sealer)
    found = prepared(thinking.consulted, plant, thinking.directory)
    learning = _learning(thinking, plant, found, send)
    if learning is not None:
        outside.trace.subscribe(learning.hear)
    arrangement = Arrangement(
        archive=Texts(thinking.directory, lambda what: contextlib.suppress(OSError)),
        budget=thinking.budget,
        language=found.language,
        protocol=AskingProtocol(thinking.consulted.protocol),
        playbook=found.book,
    )
    exchange, worker = recovery_beside(plant, outside, seed=1, arrangement=arrangement)
    worker.start()
    return _Begun(exchange, found.troubles, "" if found.content is None else found.content.sha256, learning)


def _learning(
    thinking: Thinking, plant: Plant, found: Prepared, send: Callable[[FromThinking], object]
) -> Learning | None:
    """What follows releases for the playbook; None where there is none."""
    path, started = thinking.consulted.playbook, begins(thinking.directory)
    if path is None or found.book is None or found.content is None or started is None:
        return None
    learning = Learning(plant, found.book, Path(path), thinking.directory, send)
    learning.begin(started.wall_started, found.content.entries)
    return learning


def _give_up(away: Away, reason: str) -> None:
    """End this process, because another one may do better."""
    print(f"homeostat: thinking ends: {reason}", file=sys.stderr, flush=True)
    away.send(Trouble("recovery:lost", reason))
    time.sleep(PULSE_S)  # until it was sent
    os._exit(LOST)
