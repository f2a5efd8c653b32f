"""The process of the guard: link, rules, journal and doors, and nothing that thinks."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from types import FrameType
from typing import Final

from homeostat.domain.mode import Mode, Role
from homeostat.domain.observation import Observation, Settled, Trouble
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.quotation import printable
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Record, RunFinished, Setting, Summary
from homeostat.journal.beside.files import JOURNAL
from homeostat.links.opcua.link import OpcuaLink
from homeostat.links.opcua.mapping import LinkMapping
from homeostat.links.opcua.reading.node_sample import NodeSample
from homeostat.links.opcua.security.security import Security
from homeostat.plants.wired.guarding import ISSUER
from homeostat.record.directory import RunDirectory
from homeostat.recovery.exchange.reading import Reader
from homeostat.service.attached.mirroring import Mirror
from homeostat.service.attached.place import HISTORY, RECALLED, THINKING, changed, first_event
from homeostat.service.attached.source import SLACK_S, Onward
from homeostat.service.attached.standing import Standing
from homeostat.service.attached.status import StatusBoard
from homeostat.service.doors.door import Behind, Doors
from homeostat.service.doors.messages import within_s
from homeostat.service.historian.line import HistoryLine
from homeostat.service.historian.observed import Observed
from homeostat.service.historian.recording import Recording
from homeostat.service.order import run_identity
from homeostat.service.thinking.codec import Hello
from homeostat.service.thinking.line import Answering, ThinkingLine

STOPPED: Final = "stopped"
"""Outcome in the journal of an attached plant whose service was stopped."""
REFUSED: Final = 2
"""Exit status of a guard that could not begin, and would not the next time either."""
ALONE: Final = 1
"""Exit status of a guard that had not begun when whoever looked after it was gone."""
ALONE_S: Final = 0.1
"""How often it is looked whether they are still there until it has begun, wall-clock [s]."""
FIRST_S: Final = 3.0
"""Longest wait for the first connection before the first tick, wall-clock [s]."""
LOOK_S: Final = 0.05
"""How often it is looked for, wall-clock [s]."""
BEYOND_S: Final = 1.0
"""What a look at the link may take beyond a period, wall-clock [s]."""


@dataclass(frozen=True, slots=True)
class Attaching:
    """What a plant is attached with; all of it is read before the guard's process begins."""

    rules: GuardRules
    """What the guard knows of the plant."""
    mapping: LinkMapping
    """Which node shows and takes which tag."""
    security: Security
    """How the link shows who it is."""
    directory: Path
    """Directory of journal and sockets."""
    settings: tuple[Setting, ...]
    """As the journal has it."""
    guard: GuardSettings
    """How long the guard waits, and how many people must agree to a reset."""
    pace: float
    """Process seconds per wall-clock second."""
    groups: Mapping[Role, int]
    """Role -> number of the group that has it beside the owner."""
    key: bytes
    """Key of the release check's seals; thinking is told, and nobody else."""
    history: Path | None = None
    """Folder of the history; None where none is kept."""
    believed: frozenset[str] = frozenset()
    """Logins whose names count as people; any other login is one person."""


def guard(attaching: Attaching, pulse: int, parent: int) -> int:
    """Guard until this process is told to end, or whoever started it is gone; the exit status.

    ``pulse``: descriptor that takes a byte at each tick; ``parent``: number of the process that started it.
    """
    stopping: list[str] = []
    waiting: list[Onward] = []

    def stop(number: int, frame: FrameType | None) -> None:
        stopping.append("the service was stopped")
        for source in waiting:
            source.stop()

    def alive() -> None:
        with contextlib.suppress(OSError):
            os.write(pulse, b".")
        if os.getppid() != parent and not stopping:  # also while a sample is waited for: another service waits for us
            stopping.append("whoever looked after the guard is gone")
            for source in waiting:
                source.stop()

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C at the terminal is for whoever started this
    signal.signal(signal.SIGTERM, stop)
    begun = threading.Event()
    threading.Thread(target=_leave_alone, args=(parent, begun), name="beginning", daemon=True).start()
    with contextlib.ExitStack() as ending:
        try:
            guarding = _begun(attaching, ending)
        except (OSError, ValueError) as trouble:
            return _refused(trouble)
        begun.set()
        guarding.source.alive = alive
        waiting.append(guarding.source)
        while not stopping:
            guarding.tick()
            alive()
        guarding.stop(stopping[0])
    return 0


def _begun(attaching: Attaching, ending: contextlib.ExitStack) -> _Guarding:
    """A guard at its first tick; ``ending`` closes what it was begun with.

    The link connects while the journal is read. What writes is taken by a guard, and there is none before that.
    """
    link = ending.enter_context(OpcuaLink(attaching.mapping, attaching.rules, attaching.security, attaching.pace))
    directory, records = _opened(attaching)
    ending.enter_context(directory)
    if directory.unsigned:
        print(f"homeostat: the journal is not signed: {printable(directory.unsigned)}", file=sys.stderr, flush=True)
    return _Guarding(attaching, directory, records, link)  # of the records, months of them, it keeps what counts


def _leave_alone(parent: int, begun: threading.Event) -> None:
    """End this process where ``parent`` is gone before a guard has ``begun``: another service waits for the directory.

    Nothing was written to the plant by then, and a journal is gone on with wherever it ends.
    """
    while not begun.wait(ALONE_S):
        if os.getppid() != parent:
            os._exit(ALONE)


def _refused(trouble: Exception) -> int:
    """Say in one line why the guard cannot begin; its exit status."""
    print(f"homeostat: {printable(' '.join(str(trouble).split()))}", file=sys.stderr, flush=True)
    return REFUSED


def _opened(attaching: Attaching) -> tuple[RunDirectory, tuple[Record, ...]]:
    """The journal, begun or gone on with, and what it held."""
    path, versions = attaching.directory, (Setting("python", sys.version.split()[0]),)
    if (path / JOURNAL).exists():
        stated = (*attaching.settings, *versions)
        return RunDirectory.reopen(path, RECALLED, lambda records: changed(records, stated))
    directory = RunDirectory(path)
    started = datetime.now().astimezone().isoformat(timespec="milliseconds")
    directory.record(first_event(attaching.rules.plant, attaching.settings, started, versions), 0.0)
    return directory, ()


class _Guarding:
    """A guard that is attached, tick by tick."""

    def __init__(
        self, attaching: Attaching, directory: RunDirectory, records: tuple[Record, ...], link: OpcuaLink
    ) -> None:
        rules, self._directory = attaching.rules, directory
        self._configuration = rules.configuration
        self._link = link
        self.source = source = Onward(link.source, records[-1].at_s if records else 0.0, attaching.pace, rules.timing)
        """What is waited for, tick by tick."""
        self._tick_s = rules.timing.tick_s
        memory = Memory.of(records) if records else None
        attachment = Attachment(directory.trace, link, Mode.OBSERVE, {ISSUER: attaching.key}, memory, goes_on=False)
        self._guard = Guard(rules, attachment, attaching.guard.for_ticks(rules.timing.tick_s))
        put = self._guard.mailbox.put
        self._reader = Reader(
            source,
            self._raise,
            self._settle,
            source.period_s + SLACK_S + BEYOND_S,
        )
        self._standing = Standing(link, attaching.mapping.connection.clock_s, put)
        shared, trusted = attaching.mapping.guard, attaching.security.encrypted
        self._mirror = Mirror(
            link, put, lists=trusted and shared.alarm is not None, holds=trusted and shared.hold is not None
        )
        known = {
            "plant": rules.plant,
            "configuration": rules.configuration,
            "signed": next((s.value for s in attaching.settings if s.name == "signed"), ""),
            "guard_process": os.getpid(),
            "writes_nothing": attaching.security.refusal,
        }
        self._board = StatusBoard(self._guard, link, lambda: link.source.missed, known)
        self._board.recall(records)
        directory.trace.subscribe(self._board.follow)
        behind = Behind(put, self._board.told, run_identity(attaching.directory), within_s(source.period_s))
        self._doors = Doors(attaching.directory, behind, attaching.groups, attaching.believed)
        directory.trace.subscribe(self._doors.follow)
        hello = Hello(attaching.key, rules.configuration)
        answering = Answering(put, directory.trace, rules.machine)
        self._thinking = ThinkingLine(attaching.directory / THINKING, hello, answering)
        self._recording: Recording | None = None
        if attaching.history is not None:
            line = HistoryLine(attaching.directory / HISTORY, put)
            self._recording = Recording(line, Observed(attaching.mapping), rules.plant)
            directory.trace.subscribe(self._recording.hear)
        self._last: Observation | None = None
        self._await(link)

    @staticmethod
    def _await(link: OpcuaLink) -> None:
        """Give the first connection a moment: a plant that is being connected to is no alarm."""
        until = time.monotonic() + FIRST_S
        while link.trouble and time.monotonic() < until:
            time.sleep(LOOK_S)
        link.source.skip()  # a long journal was read meanwhile

    def tick(self) -> None:
        """One tick: a sample or its absence, one decision, and everybody is told."""
        now_s, sample = self._reader.read(self._tick_s)
        self._standing.look(self._guard.mode)
        self._last = seen = self._guard.tick(now_s, sample)
        self._mirror.look(self._guard.alarms, self._guard.latched is not None, self._guard.mode)
        self._board.show(seen)
        self._thinking.show(seen)
        if self._recording is not None and isinstance(seen.sample, NodeSample):
            self._recording.see(seen.sample)

    def _raise(self, name: str, cause: str) -> None:
        self._guard.mailbox.put(Trouble(name, cause))

    def _settle(self, name: str) -> None:
        self._guard.mailbox.put(Settled(name))

    def stop(self, reason: str) -> None:
        """End without moving the plant: the lease goes back, and the journal is closed."""
        self._doors.close()
        self._thinking.close()
        self._mirror.close()
        self._guard.stop(reason)
        self._link.close()
        at_s = 0.0 if self._last is None else self._last.now_s
        self._directory.record(RunFinished(STOPPED, reason), at_s)
        self._directory.close(Summary(1, STOPPED, self._configuration))
        if self._recording is not None:
            self._recording.close()
