"""The process of the historian: it takes what the guard sends, and says how far it has come once that is kept."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from dataclasses import dataclass
from multiprocessing.connection import Client, Connection
from pathlib import Path
from types import FrameType
from typing import Final

from homeostat.domain.quotation import printable
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS, Batch, Span
from homeostat.history.store import HistoryError, HistoryStore, Occurrence
from homeostat.service.attached.place import HISTORY
from homeostat.service.historian.messages import LARGEST, Back, Kept, from_guard, to_guard
from homeostat.service.historian.observed import PROCESS_TIME

AGAIN_S: Final = 0.2
"""Wait before the guard is looked for again, and before what had no room is tried again, wall-clock [s]."""
LOOK_S: Final = 0.5
"""How often it is looked whether there is still a guard to keep for, wall-clock [s]."""
LATELY_US: Final = 1_800_000_000
"""How far before the newest sample it is looked for what was kept already: a guard sends again what it was not told
of, and that is what was kept last [us]."""
NO_STORE: Final = 2
"""Exit status where the folder is none that can be kept in."""


@dataclass(frozen=True, slots=True)
class Keeping:
    """What a process keeps."""

    directory: Path
    """Directory of the attached plant."""
    folder: Path
    """Folder of the history."""
    pulse: int
    """Descriptor that takes a byte each time it says that it goes on."""
    parent: int
    """Number of the process that started it: it may be gone before this one has loaded anything."""


def keep(keeping: Keeping) -> int:
    """Keep until this process is told to end, or whoever started it is gone; the exit status."""
    stopping = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        stopping.set()

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C at the terminal is for whoever started this
    signal.signal(signal.SIGTERM, stop)
    try:
        store = EmbeddedStore(keeping.folder)
    except (HistoryError, OSError) as refused:
        _say(str(refused))
        return NO_STORE
    with store:
        _Keeping(keeping, store, stopping).go_on()
    for trouble in store.take_troubles():
        _say(trouble)
    return 0


class _Keeping:
    """Takes from one guard after another."""

    def __init__(self, keeping: Keeping, store: HistoryStore, stopping: threading.Event) -> None:
        self._keeping, self._store, self._stopping = keeping, store, stopping
        self._taken, self._trouble = 0, ""
        self._known = _kept_lately(store)

    def go_on(self) -> None:
        while self._goes_on():
            try:
                connection: Connection = Client(str(self._keeping.directory / HISTORY), family="AF_UNIX")
            except OSError:
                time.sleep(AGAIN_S)
                continue
            with contextlib.suppress(OSError, EOFError), connection:
                self._take_from(connection)

    def _goes_on(self) -> bool:
        """Say that this process goes on; whether it shall."""
        with contextlib.suppress(OSError):
            os.write(self._keeping.pulse, b".")
        if os.getppid() != self._keeping.parent:
            self._stopping.set()
        return not self._stopping.is_set()

    def _take_from(self, connection: Connection) -> None:
        """Keep what one guard sends until it is gone, or we are told to end and it has nothing more to say."""
        self._taken = 0
        while self._goes_on() or connection.poll():
            if not connection.poll(LOOK_S):
                continue
            kept = from_guard(connection.recv_bytes(LARGEST))
            if not (_identity(kept.what) in self._known or self._kept(kept, connection)):
                return  # what follows would say that this was kept, too
            self._taken = kept.number
            for trouble in self._store.take_troubles():
                _say(trouble)
                self._trouble = trouble
            self._back(connection)
            self._trouble = ""

    def _kept(self, kept: Kept, connection: Connection) -> bool:
        """Keep it, as soon as there is room; False where this process is told to end before that."""
        while True:
            try:
                if isinstance(kept.what, Batch):
                    self._store.append(kept.what)
                else:
                    self._store.record(kept.what)
            except OSError as full:
                self._trouble = f"no sample is kept: {full.strerror or full}; make room, or keep less in history.toml"
                self._back(connection)
                if not self._goes_on():
                    return False
                self._stopping.wait(LOOK_S)
            except ValueError as unfit:  # it would be that the next time, too, and what follows would wait for it
                _say(f"not kept: {unfit}")
                self._trouble = f"one of the samples or events cannot be kept: {unfit}"
                return True
            else:
                return True

    def _back(self, connection: Connection) -> None:
        connection.send_bytes(to_guard(Back(self._taken, self._trouble[:1000])))


def _kept_lately(store: HistoryStore) -> set[tuple[int, str]]:
    """What a historian before us has kept and may not have said so: a guard sends that again.

    Where that cannot be read, one sample may be kept twice, which is better than none.
    """
    try:
        if PROCESS_TIME not in store.tags():
            return set()
        last = store.last([PROCESS_TIME])[PROCESS_TIME]  # a source whose clock is wrong must not hide it
        if not last.length:
            return set()
        lately = Span(int(last.time_us[0]) - LATELY_US, int(last.time_us[0]) + 1)
        known = {(own_us, "") for own_us in store.read([PROCESS_TIME], lately)[PROCESS_TIME].own_us.tolist()}
        since_us = max(int(last.own_us[0]) - LATELY_US, ALWAYS.from_us)
        return known | {_identity(each) for each in store.occurrences(Span(since_us, ALWAYS.to_us))}
    except (HistoryError, OSError) as unread:
        _say(f"what was kept last cannot be read: {unread}")
        return set()


def _identity(what: Batch | Occurrence) -> tuple[int, str]:
    """What tells one batch or occurrence from another."""
    return (what.own_us, "") if isinstance(what, Batch) else (what.own_us, f"{what.kind} {what.details}")


def _say(trouble: str) -> None:
    print(f"homeostat: history: {printable(' '.join(trouble.split()))}", file=sys.stderr, flush=True)
