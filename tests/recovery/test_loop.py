"""The loop in scaled real time, and what overtakes thinking."""

from __future__ import annotations

import threading
from dataclasses import replace

import pytest

from homeostat.domain.mode import Mode
from homeostat.domain.observation import FallBack, Observation, Trouble
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.recovery.exchange.exchange import Exchange
from homeostat.recovery.exchange.loop import Loop, overtaken_by
from homeostat.recovery.exchange.worker import Worker
from tests.recovery.guarded import Scripted, Seconds, observation

SCALE = 200.0
"""Process seconds per wall-clock second."""


def test_in_real_time_recovery_thinks_while_the_plant_goes_on_and_persons_are_heard_each_tick() -> None:
    guard, shown, ticks = Scripted(), [], []
    exchange = Exchange(ThinkingClock(SCALE), guard.put, lambda reason: None)
    go_on = threading.Event()

    async def recovery() -> None:
        async def work() -> None:
            ticks.append(len(guard.ticks))
            go_on.wait(30.0)  # the thought never yields; the plant does not wait for it
            ticks.append(len(guard.ticks))

        while (seen := await exchange.next()) is not None:
            if seen.now_s == 5.0:
                await exchange.think(work())

    def hook(seen: Observation) -> None:
        shown.append(seen.now_s)
        if seen.now_s == 10.0:
            guard.put(FallBack("a person says so"))
        if seen.now_s == 20.0:
            go_on.set()

    worker = Worker(exchange, recovery, lambda cause: None)
    worker.start()
    Loop(guard, Seconds(30.0), exchange, hook).run_paced(SCALE)
    assert worker.join(30.0)
    assert shown == guard.ticks == [float(k) for k in range(1, 31)]
    assert guard.taken == [(11.0, FallBack("a person says so"))]
    assert ticks[1] - ticks[0] >= 10


def test_an_onlooker_that_fails_is_an_alarm_and_the_run_goes_on() -> None:
    guard = Scripted()
    exchange = Exchange(DeclaredClock(0.0), guard.put, lambda reason: None)

    async def recovery() -> None:
        while await exchange.next() is not None:
            pass

    def hook(seen: Observation) -> None:
        if seen.now_s == 3.0:
            raise OSError("the folder is gone")

    worker = Worker(exchange, recovery, lambda cause: None)
    worker.start()
    Loop(guard, Seconds(10.0), exchange, hook).run_virtual()
    assert worker.join(30.0) and len(guard.ticks) == 10
    assert guard.taken == [(4.0, Trouble("onlooker", "what is shown every tick failed: the folder is gone"))]


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({}, None),
        ({"latched": "too hot"}, "the fallback was activated: too hot"),
        ({"mode": Mode.APPROVE}, "the mode is approve now"),
        ({"state": "still"}, None),
    ],
)
def test_thinking_is_overtaken_by_a_fallback_a_reset_and_a_change_of_mode(
    changed: dict[str, object], told: str | None
) -> None:
    before = observation(1.0)
    after = replace(before, now_s=2.0, **changed)  # type: ignore[arg-type]
    assert overtaken_by(before, after) == told
    assert overtaken_by(after, after) is None
    if "latched" in changed:
        assert overtaken_by(after, before) == "the latch was reset"
