"""The guard's end of the line to thinking: observations go out, messages come in, and the guard waits for neither."""

from __future__ import annotations

import contextlib
import os
import threading
import time
import zlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Listener
from pathlib import Path
from typing import Final, final

from homeostat.domain.events.guard import ThinkingBegan, ThinkingEnded
from homeostat.domain.observation import Message, Observation, Settled, Trouble
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.journal import Trace
from homeostat.service.shared import Shared
from homeostat.service.thinking.codec import LARGEST, Hello, Ready, Recorded, from_thinking, to_thinking

MOST: Final = 3600
"""Most observations that are kept for thinking that begins again."""
MOST_BYTES: Final = 96_000_000
"""Most bytes of them, compressed."""
_LEVEL: Final = 1
"""Level of the compression: the others take longer and gain little on readings."""
MOST_NEW: Final = 600
"""Most observations that wait to be packed while thinking takes none; older ones are dropped."""
MOST_ALARMS: Final = 20
"""Most alarms of thinking's that are passed on in a tick: the guard hears so many, and has its own to hear."""
MOST_RAISED: Final = 100
"""Most names of alarms of thinking's that are remembered."""
AGAIN_S: Final = 0.2
"""Wait before a line that could let nobody in is tried again, wall-clock [s]."""
ALARM: Final = "recovery:thinking"
"""Alarm of a plant without thinking."""


@dataclass(frozen=True, slots=True)
class Answering:
    """What becomes of that which thinking says."""

    put: Callable[[Message], object]
    """Takes a message to the guard."""
    trace: Trace
    """Takes its events."""
    machine: StateMachine
    """Where its transitions are looked up."""


@final
class ThinkingLine:
    """Lets one process that thinks in at a time, in threads of its own."""

    def __init__(self, path: Path, hello: Hello, answering: Answering) -> None:
        """Listen at ``path``; whoever comes is told ``hello`` and then what was seen, from the oldest that is kept.

        OSError where the socket cannot be made.
        """
        self._hello, self._answering = to_thinking(hello), answering
        path.unlink(missing_ok=True)
        before = os.umask(0o177)
        try:
            self._listener = Listener(str(path), family="AF_UNIX", backlog=1)
        finally:
            os.umask(before)
        self._changed = threading.Condition()
        self._new: deque[Observation] = deque(maxlen=MOST_NEW)
        self._kept: deque[bytes] = deque()
        self._size, self._dropped = 0, 0
        self._connection: Shared | None = None
        self._next, self._now_s, self._over, self._alarms = 0, 0.0, False, 0
        self._process: int | None = None
        self._raised: set[str] = set()
        for work in (self._listen, self._tell):
            threading.Thread(target=work, name="thinking's line", daemon=True).start()

    def show(self, seen: Observation) -> None:
        """Have thinking told of one more tick; returns at once."""
        with self._changed:
            self._now_s, self._alarms = seen.now_s, 0
            self._new.append(seen)
            self._changed.notify_all()

    def close(self) -> None:
        """Nobody is told anything any more."""
        self._over = True
        with contextlib.suppress(OSError):
            self._listener.close()
        self._let_go(self._connection)

    def _listen(self) -> None:
        while not self._over:
            try:
                connection = Shared(self._listener.accept())
            except OSError:
                time.sleep(AGAIN_S)  # too many files are open, perhaps
                continue
            with contextlib.suppress(OSError):
                connection.send(self._hello)
            with self._changed:
                self._connection, self._next = connection, 0
                self._changed.notify_all()
            reason, process = self._hear(connection)
            self._let_go(connection)
            connection.close()
            if process is not None and not self._over:
                self._note(ThinkingEnded(process, reason))
                self._answering.put(Trouble(ALARM, f"{reason}; nothing is diagnosed and nothing proposed"))

    def _hear(self, connection: Shared) -> tuple[str, int | None]:
        """Take what thinking says until it is gone; why it is, and its number where it was ready."""
        process: int | None = None
        while True:
            try:
                frame = connection.receive(LARGEST)
            except (EOFError, ConnectionResetError):
                return "thinking has ended", process
            except OSError as broken:
                return f"the line to thinking broke: {broken}", process
            try:
                said = from_thinking(frame, self._answering.machine)
            except Exception as error:  # it may say anything
                self._alarm(Trouble("recovery:message", f"thinking said what nobody can take: {error!r}"))
                continue
            if isinstance(said, Ready):
                process = said.process
                self._begins(process)
                self._note(ThinkingBegan(process, said.playbook))
                self._answering.put(Settled(ALARM))
            elif isinstance(said, Recorded):
                self._record(said)
            elif isinstance(said, Trouble | Settled):
                self._alarm(said)
            else:
                self._answering.put(said)

    def _begins(self, process: int) -> None:
        """What troubled another process, which is gone, is over, or is said again: nobody else would end it."""
        if process != self._process:
            for name in sorted(self._raised):
                self._answering.put(Settled(name))
            self._raised.clear()
        self._process = process

    def _alarm(self, said: Trouble | Settled) -> None:
        """Pass on that something is wrong, or right again; what is said too often waits for nobody, and is dropped."""
        with self._changed:
            self._alarms += 1
            passes = self._alarms <= MOST_ALARMS
        if not passes:
            return
        self._answering.put(said)
        if isinstance(said, Settled):
            self._raised.discard(said.name)
        elif len(self._raised) < MOST_RAISED:
            self._raised.add(said.name)

    def _record(self, said: Recorded) -> None:
        try:
            self._answering.trace.record(said.event, said.at_s)
        except Exception as error:  # no room, or no event: the plant is watched all the same
            self._alarm(Trouble("recovery:record", f"what thinking recorded could not be journalled: {error}"))

    def _note(self, event: ThinkingBegan | ThinkingEnded) -> None:
        self._record(Recorded(event, self._now_s))

    def _tell(self) -> None:
        """Pack what is new, and send what was not sent yet."""
        while not self._over:
            with self._changed:
                self._changed.wait_for(lambda: self._new or self._owed or self._over)
                new = tuple(self._new)
                self._new.clear()
            for seen in new:
                self._keep(zlib.compress(to_thinking(seen), _LEVEL))
            with self._changed:
                connection, frame = self._connection, self._following() if self._owed else None
            if connection is not None and frame is not None:
                try:
                    connection.send(zlib.decompress(frame))
                except OSError:
                    self._let_go(connection)

    @property
    def _owed(self) -> bool:
        """Whether something that is kept was not sent to whoever is there."""
        return self._connection is not None and self._next < self._dropped + len(self._kept)

    def _following(self) -> bytes:
        """The next observation to send; what was dropped meanwhile is left out."""
        self._next = max(self._next, self._dropped) + 1
        return self._kept[self._next - 1 - self._dropped]

    def _keep(self, frame: bytes) -> None:
        with self._changed:
            self._kept.append(frame)
            self._size += len(frame)
            while len(self._kept) > MOST or self._size > MOST_BYTES:
                self._size -= len(self._kept.popleft())
                self._dropped += 1

    def _let_go(self, connection: Shared | None) -> None:
        """Send nothing by ``connection`` any more; whoever waits for it in another thread is told."""
        with self._changed:
            if connection is not None and self._connection is connection:
                self._connection = None
        if connection is not None:
            connection.end()
