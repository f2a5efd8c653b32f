"""The keeper of the connection: a thread of its own that makes a new client whenever the plant's side falls silent."""

from __future__ import annotations

import asyncio
import concurrent.futures
import random
import threading
import time
from collections.abc import Awaitable, Callable
from typing import TypeVar

from homeostat.links.errors import LinkError
from homeostat.links.opcua.connection.board import Board
from homeostat.links.opcua.connection.session import Session, told
from homeostat.links.opcua.mapping import LinkMapping
from homeostat.links.opcua.security.security import Security
from homeostat.links.opcua.writing.kinds import COUNT

T = TypeVar("T")
LOOK_S = 0.05
"""How often the age of the data is looked at [s]."""
OPEN = 3.0
"""So many answers' time all nodes may take to be shown: none of the calls for it waits for longer than one."""


class Keeper:
    """Keeps at most one session; whatever waits for it waits for a bounded time."""

    def __init__(self, mapping: LinkMapping, security: Security, board: Board) -> None:
        """What ``mapping`` reads comes to ``board``; the thread begins at once."""
        self._connection, self._security, self._board = mapping.connection, security, board
        self._nodes, self._written = mapping.readable(), mapping.written()
        self._loop = asyncio.new_event_loop()
        self._session: Session | None = None
        self._ended, self._stop = False, asyncio.Event()
        self.epoch = 0
        """Counts connections that were up; one that is lost counts, too."""
        self.trouble = "the first connection is being made"
        """Why there is no connection; empty while there is one."""
        self._thread = threading.Thread(target=self._run, name="opcua link", daemon=True)
        self._thread.start()

    @property
    def up(self) -> bool:
        """Whether there is a connection over which fresh data come."""
        return self._session is not None

    def largest(self, node: str) -> int:
        """Up to what we can count in ``node`` of the server that is connected."""
        session = self._session
        return COUNT if session is None else session.largest(node)

    def begin(self, work: Callable[[Session], Awaitable[T]], epoch: int) -> concurrent.futures.Future[T]:
        """Do ``work`` with the session of ``epoch``; LinkError at once where that is over. It is never done twice."""

        async def bound() -> T:
            session = self._session
            if session is None or epoch != self.epoch or time.monotonic() > late_s:
                raise LinkError("the connection was lost before anything was written")
            return await asyncio.wait_for(work(session), self._connection.answer_s)

        late_s = time.monotonic() + self._connection.answer_s
        if self._ended or self._session is None or epoch != self.epoch:
            raise LinkError(f"there is no connection: {self.trouble or 'it is a new one meanwhile'}")
        return asyncio.run_coroutine_threadsafe(bound(), self._loop)

    def close(self) -> None:
        """End the connection and the thread."""
        if not self._ended:
            self._ended, self.trouble = True, "the link was closed"
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join(self._connection.answer_s)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._keep())
        finally:
            self._loop.close()

    async def _keep(self) -> None:
        """Connect, watch, and connect again, with longer and longer waits as long as nothing comes of it."""
        wait_s = self._connection.retry_s
        while not self._ended:
            session: Session | None = None
            try:
                try:
                    session = Session(self._connection, self._security, self._board)
                    await asyncio.wait_for(session.connect(), self._connection.answer_s)
                    await asyncio.wait_for(session.open(self._nodes, self._written), OPEN * self._connection.answer_s)
                    began_s = time.monotonic()
                    self.trouble = await self._watch(session)
                    if time.monotonic() - began_s > self._connection.retry_most_s:
                        wait_s = self._connection.retry_s
                except Exception as broken:  # certificates, sockets, time-outs: whatever a server can do
                    self.trouble = f"{self._connection.url}: {told(broken)}"
            finally:
                self._lose()
                pause_s = 0.0 if self._ended else wait_s * random.uniform(0.8, 1.2)
                await asyncio.gather(self._pause(pause_s), *(() if session is None else (session.close(),)))
            wait_s = min(2.0 * wait_s, self._connection.retry_most_s)

    async def _watch(self, session: Session) -> str:
        """Look on while data come; why they do not any more."""
        limit_s = self._connection.dead_s
        begin_s = time.monotonic()
        while not self._ended:
            silent_s = min(self._board.age_s, time.monotonic() - begin_s)
            if session.lost:
                return session.lost
            if silent_s > limit_s:
                return f"nothing that must change has changed for {silent_s:.1f} s"
            if self._session is None and self._board.age_s < time.monotonic() - begin_s:
                self.epoch += 1
                self.trouble, self._session = "", session
            await asyncio.sleep(LOOK_S)
        return "the link was closed"

    def _lose(self) -> None:
        if self._session is not None:
            self.epoch += 1
            self._session = None
        self._board.clear()

    async def _pause(self, seconds: float) -> None:
        try:
            await asyncio.wait_for(self._stop.wait(), seconds)
        except TimeoutError:
            return
