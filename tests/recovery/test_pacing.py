"""The pace of a run in virtual time: it waits, stands, goes on, and ends whatever it waits for."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

from homeostat.links.clock import DeclaredClock
from homeostat.recovery.exchange.exchange import Exchange
from homeostat.recovery.exchange.loop import Loop
from homeostat.recovery.exchange.pacing import AWAITED_S, FASTEST, SLOWEST, Pace, Pacing
from homeostat.recovery.exchange.worker import Worker
from tests.recovery.guarded import Scripted, Seconds

LIMIT_S = 30.0


def until(so: Callable[[], bool]) -> None:
    deadline = time.monotonic() + LIMIT_S
    while not so():
        assert time.monotonic() < deadline
        time.sleep(0.005)


class Going:
    """A run of ``end_s`` ticks in a thread of its own, with a recovery that thinks at 5 s until it may end."""

    def __init__(self, pacing: Pacing, end_s: float, cost_s: float = 0.0) -> None:
        self.guard, self.pacing, self.thinks, self.may_end = Scripted(), pacing, threading.Event(), threading.Event()
        self.exchange = Exchange(DeclaredClock(cost_s), self.guard.put, lambda reason: None)
        self.worker = Worker(self.exchange, self.recovery, lambda cause: None)
        loop = Loop(self.guard, Seconds(end_s), self.exchange)
        self.thread = threading.Thread(target=lambda: loop.run_virtual(pacing=pacing), daemon=True)
        self.worker.start()
        self.thread.start()

    async def recovery(self) -> None:
        async def work() -> None:
            self.thinks.set()
            self.may_end.wait(LIMIT_S)

        while (seen := await self.exchange.next()) is not None:
            if seen.now_s == 5.0:
                await self.exchange.think(work())

    @property
    def ticks(self) -> int:
        return len(self.guard.ticks)

    def over(self) -> None:
        self.thread.join(LIMIT_S)
        assert not self.thread.is_alive() and self.worker.join(LIMIT_S)
        assert self.pacing.now is None


@pytest.mark.parametrize("speed", [float("nan"), float("inf"), -1.0, 0.0, SLOWEST / 2, 2 * FASTEST, 1e300])
def test_a_speed_that_is_none_is_refused_and_changes_nothing(speed: float) -> None:
    with pytest.raises(ValueError, match=r"from 0\.1 to 1000"):
        Pacing(speed)
    pacing = Pacing(10.0)
    with pytest.raises(ValueError, match=r"from 0\.1 to 1000"):
        pacing.choose(speed)
    assert pacing.now == Pace(10.0, False, False)


def test_a_run_takes_its_time() -> None:
    begun = time.monotonic()
    going = Going(Pacing(100.0), 4.0)
    going.over()
    assert time.monotonic() - begun >= 0.04


def test_it_stands_where_it_is_paused_and_goes_on_from_there() -> None:
    going = Going(Pacing(200.0), 1e6)
    going.may_end.set()
    until(lambda: going.ticks > 8)
    going.pacing.pause()
    until(lambda: going.pacing.now == Pace(200.0, True, True))
    before = going.ticks
    time.sleep(0.1)
    assert going.ticks == before
    going.pacing.choose(FASTEST)
    time.sleep(0.05)
    assert going.ticks == before and going.pacing.now == Pace(FASTEST, True, True)
    going.pacing.go_on()
    until(lambda: going.ticks > before + 20)
    assert going.pacing.now == Pace(FASTEST, False, False)
    going.pacing.pause()
    until(lambda: going.pacing.now == Pace(FASTEST, True, True))
    going.pacing.end()  # nobody will ever let it go on
    before = going.ticks
    until(lambda: going.ticks > before)


def test_a_new_speed_counts_from_now_on_also_for_the_tick_that_is_waited_for() -> None:
    going = Going(Pacing(SLOWEST), 4.0)
    until(lambda: going.ticks == 1)
    begun = time.monotonic()
    going.pacing.choose(FASTEST)
    going.over()
    assert time.monotonic() - begun < 9.0, "at 0.1 it would have taken 40 s"


def test_what_is_thought_comes_to_its_end_before_the_run_stands() -> None:
    going = Going(Pacing(FASTEST), 40.0, cost_s=10.0)
    assert going.thinks.wait(LIMIT_S)
    going.pacing.pause()
    assert going.pacing.now == Pace(FASTEST, True, False)
    going.may_end.set()
    until(lambda: going.pacing.now == Pace(FASTEST, True, True))
    assert going.ticks == 15, "the thought cost 10 s, which have passed"
    going.pacing.go_on()
    going.over()
    assert going.ticks == 40


def test_a_run_that_loses_recovery_can_be_paused_all_the_same() -> None:
    going = Going(Pacing(FASTEST), 1e6)
    going.exchange.give_up("recovery is lost")
    going.pacing.pause()
    until(lambda: going.pacing.now == Pace(FASTEST, True, True))
    going.pacing.end()
    going.may_end.set()


def test_who_waits_for_an_answer_has_it_however_slow_the_run_and_also_where_it_is_paused_meanwhile() -> None:
    going = Going(Pacing(SLOWEST), 1e6)
    going.may_end.set()
    until(lambda: going.ticks == 1)
    begun = time.monotonic()
    with going.pacing.answering():
        going.pacing.pause()
        until(lambda: going.ticks >= 3)
        assert time.monotonic() - begun < 3.0 * AWAITED_S, "at 0.1 two ticks take 20 s"
        assert going.ticks == 3, "it does not race ahead meanwhile"
    until(lambda: going.pacing.now == Pace(SLOWEST, True, True))
    going.pacing.end()
