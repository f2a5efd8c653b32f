"""Threads that answers are made in: few of them, and fewer for one person, so that orders never wait for trends."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final, TypeVar, final
from weakref import WeakValueDictionary

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

from homeostat.console.server.admission import session_of

AT_ONCE: Final = 4
"""Most answers that are made at once."""
OF_ONE: Final = 2
"""Most of them for one person."""
T = TypeVar("T")


class Gone(Exception):
    """Nobody is there any more who would read an answer."""


@final
class Lanes:
    """The threads of one server."""

    def __init__(self) -> None:
        """Nothing is made yet."""
        self._all = asyncio.Semaphore(AT_ONCE)
        self._own: WeakValueDictionary[str, asyncio.Semaphore] = WeakValueDictionary()

    async def make(self, request: Request, answer: Callable[..., T], *about: object) -> T:
        """``answer`` of ``about``, made in a thread; Gone where who has sent ``request`` does not wait for it."""
        session = session_of(request)
        name = "" if session is None else session.person.name
        own = self._own.setdefault(name, asyncio.Semaphore(OF_ONE))
        async with own, self._all:
            if await request.is_disconnected():
                raise Gone
            return await run_in_threadpool(answer, *about)
