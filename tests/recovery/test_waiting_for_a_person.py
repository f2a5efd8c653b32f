"""Time that a request waits for a person is nobody's thinking, however the wait ends."""

from __future__ import annotations

import math
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from homeostat.domain.mode import Mode
from homeostat.recovery.exchange.exchange import Exchange
from homeostat.recovery.exchange.loop import Loop
from homeostat.recovery.exchange.worker import Worker
from tests.recovery.guarded import Scripted, Seconds
from tests.recovery.test_exchange import REQUEST

ASKED_S, ENDS_S, END_S = 5.0, 45.0, 120.0


class TickClock:
    """A measured clock on a wall on which one second passes at every tick of ``guard``."""

    measured = True

    def __init__(self, guard: Scripted) -> None:
        self._guard = guard
        self._owed_s = 0.0
        self._since: int | None = None

    def start(self) -> None:
        self._settle()
        self._since = len(self._guard.ticks)

    def stop(self) -> None:
        self._settle()
        self._since = None

    def collect_s(self) -> float:
        self._settle()
        owed, self._owed_s = self._owed_s, 0.0
        return owed

    hang_s = math.inf

    def wall_s(self, process_s: float) -> float:
        return 30.0

    def _settle(self) -> None:
        if self._since is not None:
            now = len(self._guard.ticks)
            self._owed_s, self._since = self._owed_s + (now - self._since), now


def by_a_trip(guard: Scripted) -> None:
    guard.latch_at_s = ENDS_S


def by_a_mode(guard: Scripted) -> None:
    guard.mode_at = {ENDS_S: Mode.OBSERVE}


def answered_at(guard: Scripted, asking: Callable[[Exchange], Coroutine[Any, Any, None]]) -> list[float]:
    """When whoever looks up at the end of the wait is answered [s]."""
    found: list[float] = []

    async def recovery(desk: Exchange) -> None:
        async def looks() -> None:
            found.append((await desk.since(0.0))[-1].now_s)

        while (o := await desk.next()) is not None:
            if o.now_s == ASKED_S:
                await desk.think(asking(desk))
            elif o.now_s == ENDS_S:
                await desk.think(looks())

    exchange = Exchange(TickClock(guard), guard.put, lambda reason: None)
    worker = Worker(exchange, lambda: recovery(exchange), lambda cause: None)
    worker.start()
    Loop(guard, Seconds(END_S), exchange).run_virtual()
    assert worker.join(30.0)
    return found


@pytest.mark.parametrize("overtake", [by_a_trip, by_a_mode])
def test_a_wait_that_is_overtaken_is_not_charged_to_what_is_thought_next(overtake: Callable[[Scripted], None]) -> None:
    guard = Scripted()
    overtake(guard)

    async def asks(desk: Exchange) -> None:
        await desk.ask(REQUEST, 600.0)

    assert answered_at(guard, asks) == [ENDS_S]
