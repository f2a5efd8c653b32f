"""Thinking's end of the line to the guard: it comes back to a guard that has begun again."""

from __future__ import annotations

import contextlib
import os
import queue
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Client
from pathlib import Path
from typing import Final, final

from homeostat.domain.plant.state_machine import StateMachine
from homeostat.journal.encode import encode_fields
from homeostat.journal.events import Event, Subscriber
from homeostat.journal.listeners import Listeners
from homeostat.service.shared import Shared
from homeostat.service.thinking.codec import LARGEST, FromThinking, Ready, Recorded, Told, from_guard, to_guard

MOST: Final = 10_000
"""Most messages that wait to be sent; what comes then is dropped."""
AGAIN_S: Final = 0.2
"""Wait before the guard is looked for again, wall-clock [s]."""


@final
class Away:
    """Sends in a thread of its own; what was meant for a guard that is gone is dropped with it."""

    def __init__(self, path: Path, machine: StateMachine, goes_on: Callable[[], bool]) -> None:
        """``path``: the guard's socket; ``machine``: the plant's, of which the guard tells names alone.

        ``goes_on``: whether there is still somebody to think for.
        """
        self._path, self._machine, self._goes_on = path, machine, goes_on
        self._waiting: queue.Queue[bytes] = queue.Queue(MOST)
        self._connection: Shared | None = None
        self._ready: Ready | None = None
        self._sending = threading.Lock()
        threading.Thread(target=self._send_on, name="line to the guard", daemon=True).start()

    def send(self, said: FromThinking) -> None:
        """Have ``said`` sent; returns at once."""
        frame = to_guard(said)
        with contextlib.suppress(queue.Full):
            self._waiting.put_nowait(frame)

    def ready(self, playbook: str = "") -> None:
        """Everything is loaded: this guard is told, and every one that comes after it.

        ``playbook``: digest of the one that this process begins with; empty for none.
        """
        self._ready = Ready(os.getpid(), playbook)
        self.send(self._ready)

    def told(self) -> Iterator[Told]:
        """What guards tell, one after another, until there is nobody to think for."""
        while self._goes_on():
            try:
                connection = Shared(Client(str(self._path), family="AF_UNIX"))
            except OSError:
                time.sleep(AGAIN_S)
                continue
            self._connection = connection
            if self._ready is not None:
                self.send(self._ready)
            with contextlib.suppress(OSError, EOFError):
                while True:
                    yield from_guard(connection.receive(LARGEST), self._machine)
            self._connection = None
            connection.end()  # or who sends to a guard that reads nothing would be waited for
            with self._sending, contextlib.suppress(queue.Empty):
                while True:
                    self._waiting.get_nowait()
            connection.close()

    def _send_on(self) -> None:
        while True:
            frame = self._waiting.get()
            connection = self._connection
            if connection is not None:
                with self._sending, contextlib.suppress(OSError):
                    connection.send(frame)


@final
class AwayTrace:
    """Implements `homeostat.journal.events.Trace`: events travel to the guard's journal."""

    def __init__(self, send: Callable[[Recorded], object]) -> None:
        """``send`` takes an event on its way."""
        self._send, self._listeners = send, Listeners()

    def record(self, event: Event, at_s: float) -> None:
        """Have ``event``, which happened at process time ``at_s`` [s], journalled; TypeError for what cannot be."""
        encode_fields(event, event.kind)
        self._send(Recorded(event, at_s))
        self._listeners.put(event, at_s)
        self._listeners.tell()

    def sync(self) -> None:
        """Nothing to wait for: the guard syncs what it writes by."""

    def subscribe(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event."""
        self._listeners.add(subscriber)
