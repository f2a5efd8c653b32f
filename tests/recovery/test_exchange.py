"""Exchange: two threads meet, thinking is charged, and nothing that thinks holds the guard."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Coroutine
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import FallBack, Observation, Withdraw
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.request import Answer, Request, RequestStatus, Seal
from homeostat.domain.snapshot import Snapshot
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.process.batch import ProcessError
from homeostat.recovery.exchange.exchange import Exchange, ExchangeSettings
from homeostat.recovery.exchange.loop import Loop
from homeostat.recovery.exchange.worker import Worker
from tests.recovery.guarded import Scripted, Seconds, observation

REQUEST = Request(
    "r1", "search", "running", ActionSet((Command("F.sp", 0.01, None),), "running"), ("adjust",), "", "",
    Seal("", 0.0, 0.0, "", ""),
)  # fmt: skip
Recovery = Callable[[Exchange], Coroutine[Any, Any, None]]
LONG_S = 60.0
"""Longest wait for a thread of a busy host, wall-clock [s]."""


class Run:
    """One run of a scripted guard with a recovery."""

    def __init__(
        self, recovery: Recovery, clock: ThinkingClock | DeclaredClock, end_s: float = 20.0,
        guard: Scripted | None = None, busy_s: float = 30.0, source: Seconds | None = None,
    ) -> None:  # fmt: skip
        self.guard = guard or Scripted()
        self.lost: list[str] = []
        self.alarms: list[str] = []
        self.exchange = Exchange(clock, self.guard.put, self.lost.append, ExchangeSettings(busy_s=busy_s))
        self.worker = Worker(self.exchange, lambda: recovery(self.exchange), self.alarms.append)
        self.worker.start()
        try:
            Loop(self.guard, source or Seconds(end_s), self.exchange).run_virtual()
        finally:
            self.ended = self.worker.join(0.0 if self.lost or isinstance(clock, ThinkingClock) else LONG_S)


def done(request: Request, at_s: float) -> tuple[Answer, ...]:
    return (Answer(request.id, RequestStatus.ACCEPTED, at_s), Answer(request.id, RequestStatus.CONFIRMED, at_s))


def test_every_observation_is_seen_once_and_in_order() -> None:
    seen: list[float] = []

    async def recovery(desk: Exchange) -> None:
        while (o := await desk.next()) is not None:
            seen.append(o.now_s)

    run = Run(recovery, DeclaredClock(1.0), 300.0)
    assert seen == [float(k) for k in range(1, 301)] and run.ended and run.exchange.dropped == 0


@pytest.mark.parametrize(("cost_s", "expected"), [(0.0, 5.0), (1.0, 6.0), (2.5, 8.0)])
def test_declared_thinking_passes_before_recovery_looks_up(cost_s: float, expected: float) -> None:
    fresh: list[float] = []

    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            fresh.append((await desk.since(5.0))[-1].now_s)
            fresh.append((await desk.since(5.0))[-1].now_s)

        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                assert await desk.think(work())

    Run(recovery, DeclaredClock(cost_s))
    assert fresh == [expected, expected], "it is charged once"


def test_with_declared_thinking_the_plant_stands_while_recovery_computes() -> None:
    ticks: list[int] = []

    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            ticks.append(len(run_guard.ticks))
            await asyncio.to_thread(time.sleep, 0.05)
            ticks.append(len(run_guard.ticks))
            await desk.since(0.0)
            ticks.append(len(run_guard.ticks))

        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                await desk.think(work())

    run_guard = Scripted()
    Run(recovery, DeclaredClock(3.0), guard=run_guard)
    assert ticks == [5, 5, 8]


def test_what_is_asked_is_answered_while_the_plant_goes_on() -> None:
    answers: list[Answer] = []

    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            answers.append(await desk.ask(REQUEST, 60.0))

        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                await desk.think(work())

    run = Run(recovery, DeclaredClock(2.0), guard=Scripted(done))
    assert [a.status for a in answers] == [RequestStatus.CONFIRMED]
    assert run.guard.taken == [(8.0, REQUEST)], "the charged seconds passed before it was asked"


def test_what_nobody_answers_is_withdrawn() -> None:
    errors: list[Exception] = []

    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            try:
                await desk.ask(REQUEST, 5.0)
            except TimeoutError as error:
                errors.append(error)

        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                await desk.think(work())

    run = Run(recovery, DeclaredClock(0.0), 40.0)
    assert len(errors) == 1
    at_s = [t for t, m in run.guard.taken if isinstance(m, Withdraw) and m.request == "r1"]
    assert at_s and at_s[0] == 11.0


@pytest.mark.parametrize("late_s", [0.0, 15.0])
def test_what_nobody_answers_is_withdrawn_where_minutes_pass_between_two_ticks(late_s: float) -> None:
    """The tick after the time that there was for an answer is far behind it: who asked is gone by then, and says so."""
    sent: list[object] = []
    exchange = Exchange(DeclaredClock(0.0), sent.append, lambda reason: None, ExchangeSettings(tick_s=60.0))
    exchange.publish(observation(60.0))

    async def asks() -> None:
        asked = asyncio.create_task(exchange.ask(REQUEST, 120.0))
        for k in range(2, 20):
            await asyncio.sleep(0)
            exchange.publish(observation(60.0 * k + late_s))
            await asyncio.sleep(0.01)
            if k == 4:
                assert Withdraw(REQUEST.id, "no answer in the time that there was for it") in sent
                assert not asked.done(), "the guard has not had a tick yet to answer in"
        await asked

    with pytest.raises(TimeoutError, match="within 720 s"):
        asyncio.run(asks())


def thinking_for_ever(stop: threading.Event, yields: bool) -> Callable[[], Coroutine[Any, Any, None]]:
    async def think() -> None:
        while not stop.is_set():
            if yields:
                await asyncio.sleep(0.001)
            else:
                time.sleep(0.001)

    return think


@pytest.mark.parametrize("yields", [True, False])
def test_measured_thinking_never_holds_the_guard(yields: bool) -> None:
    """Thinking that never ends, at a thousand seconds of process per second: the guard goes on to the end."""
    stop = threading.Event()

    async def recovery(desk: Exchange) -> None:
        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                await desk.think(thinking_for_ever(stop, yields)())

    try:
        run = Run(recovery, ThinkingClock(1000.0), 200.0)
    finally:
        stop.set()
    assert run.guard.ticks == [float(k) for k in range(1, 201)] and run.lost == []


@pytest.mark.parametrize("clock", [DeclaredClock(1.0), ThinkingClock(0.0)], ids=["declared", "stopped"])
def test_where_the_plant_waits_for_thinking_it_does_not_wait_for_ever(clock: DeclaredClock | ThinkingClock) -> None:
    stop = threading.Event()

    async def recovery(desk: Exchange) -> None:
        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                await desk.think(thinking_for_ever(stop, yields=False)())

    try:
        run = Run(recovery, clock, 50.0, busy_s=0.1)
    finally:
        stop.set()
    assert len(run.guard.ticks) == 50
    assert len(run.lost) == 1 and "without a break" in run.lost[0]


@pytest.mark.parametrize("cause", ["trip", "mode"])
def test_what_is_overtaken_is_cancelled_and_sends_nothing_more(cause: str) -> None:
    ended: list[bool] = []
    guard = Scripted()
    if cause == "trip":
        guard.latch_at_s = 8.0
    else:
        guard.mode_at = {8.0: Mode.ADVISE}

    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            try:
                await desk.since(0.0)  # 10 s are charged; at 8 s it is overtaken
            finally:
                desk.put(FallBack("too late"))

        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                ended.append(await desk.think(work()))
                desk.put(FallBack("afterwards"))

    run = Run(recovery, DeclaredClock(10.0), guard=guard)
    assert ended == [False]
    assert run.guard.taken == [(9.0, FallBack("afterwards"))], "who was overtaken knows it, and may speak again"


def test_thinking_that_never_yields_and_is_overtaken_sends_nothing() -> None:
    overtaken, late = threading.Event(), threading.Event()

    class Going(Scripted):
        """It goes on to its end once what is thought has come to its own."""

        def tick(self, now_s: float, sample: Snapshot | None) -> Observation:
            if now_s == 30.0:
                overtaken.set()
                assert late.wait(LONG_S)
            return super().tick(now_s, sample)

    guard = Going()
    guard.latch_at_s = 20.0

    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            assert overtaken.wait(LONG_S)
            desk.put(FallBack("too late"))
            late.set()

        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                await desk.think(work())

    run = Run(recovery, ThinkingClock(1000.0), 60.0, guard=guard)
    assert late.is_set() and run.guard.taken == []


def test_a_bug_is_an_alarm_and_the_third_one_is_the_end_of_recovery() -> None:
    begun: list[float] = []

    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            raise RuntimeError("a bug")

        while (o := await desk.next()) is not None:
            begun.append(o.now_s)
            if o.now_s % 5.0 == 0.0:
                await desk.think(work())

    run = Run(recovery, DeclaredClock(0.0), 50.0)
    assert begun == [float(k) for k in range(1, 16)] and len(run.guard.ticks) == 50
    assert len(run.alarms) == 3 and all("RuntimeError: a bug" in a for a in run.alarms)
    assert len(run.lost) == 1


def test_a_link_that_raises_is_a_tick_without_sample_and_a_plant_that_is_gone_ends_the_run() -> None:
    async def recovery(desk: Exchange) -> None:
        while await desk.next() is not None:
            pass

    run = Run(recovery, DeclaredClock(0.0), source=Seconds(20.0, ConnectionError("gone"), 7.0))
    assert len(run.guard.ticks) == 20
    with pytest.raises(ProcessError):
        Run(recovery, DeclaredClock(0.0), source=Seconds(20.0, ProcessError("left the world"), 7.0))


def test_what_recovery_is_too_slow_for_is_dropped_and_counted() -> None:
    exchange = Exchange(DeclaredClock(0.0), lambda m: None, lambda r: None, ExchangeSettings(ring=10))
    for k in range(1, 31):
        exchange.publish(observation(float(k)))
    assert exchange.dropped == 20
    first = asyncio.run(exchange.next())
    assert first is not None and first.now_s == 21.0
    assert [o.now_s for o in asyncio.run(exchange.since(28.0))] == [29.0, 30.0]


@given(
    st.lists(st.sampled_from(["next", "think", "since", "ask", "put"]), max_size=12), st.sampled_from([0.0, 1.0, 2.5])
)
@settings(max_examples=40)
def test_whatever_recovery_does_equal_runs_are_equal(script: list[str], cost_s: float) -> None:
    """With declared thinking the two threads take turns: what the guard is sent, and when, is always the same."""

    def once() -> tuple[list[object], list[float]]:
        seen: list[float] = []

        async def recovery(desk: Exchange) -> None:
            async def work(what: str) -> None:
                await asyncio.sleep(0)
                if what in ("since", "ask"):
                    seen.extend(o.now_s for o in await desk.since(seen[-1]))
                if what == "ask":
                    await desk.ask(REQUEST, 60.0)
                if what == "put":
                    desk.put(FallBack("now"))

            for what in script:
                if (o := await desk.next()) is None:
                    return
                seen.append(o.now_s)
                if what != "next":
                    await desk.think(work(what))
            while await desk.next() is not None:
                pass

        run = Run(recovery, DeclaredClock(cost_s), 60.0, guard=Scripted(done))
        assert run.ended and run.guard.ticks == [float(k) for k in range(1, 61)]
        return list(run.guard.taken), seen

    assert once() == once()


def test_recovery_does_not_speak_for_a_person() -> None:
    exchange = Exchange(DeclaredClock(0.0), lambda message: True, lambda cause: None)
    with pytest.raises(PermissionError, match="Ada"):
        exchange.put(PersonCommand("o1", "Ada", Role.ENGINEER, Verb.RESET, reason="looks fine"))
