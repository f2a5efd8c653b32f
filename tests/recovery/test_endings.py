"""Whatever ends thinking but what overtakes it is a bug: an alarm, and the guard goes on."""

from __future__ import annotations

import asyncio

import pytest

from homeostat.domain.mode import Mode
from homeostat.links.clock import DeclaredClock
from homeostat.recovery.exchange.exchange import Exchange
from tests.recovery.guarded import Scripted
from tests.recovery.test_exchange import Recovery, Run

WAIT_S = 5.0


class Ends(BaseException):
    """Something that is no Exception."""


def cancels_everything() -> None:
    for task in asyncio.all_tasks():
        task.cancel()


RAISED = (SystemExit(0), KeyboardInterrupt(), GeneratorExit(), asyncio.CancelledError(), StopIteration(), Ends())


def ends(where: str, raised: BaseException) -> Recovery:
    """A recovery that is ended by ``raised`` at 5 s, 10 s and so on."""

    def fail() -> None:
        raise raised

    async def work() -> None:
        match where:
            case "thread":
                await asyncio.to_thread(fail)
            case "task of its own":
                await asyncio.gather(asyncio.create_task(later()))
            case _:
                fail()

    async def later() -> None:
        fail()

    async def recovery(desk: Exchange) -> None:
        while (o := await desk.next()) is not None:
            if o.now_s % 5.0 == 0.0:
                await (work() if where == "watching" else desk.think(work()))

    return recovery


@pytest.mark.parametrize("raised", RAISED, ids=lambda raised: type(raised).__name__)
@pytest.mark.parametrize("where", ["thinking", "thread", "task of its own", "watching"])
def test_whatever_thinking_raises_is_a_bug_and_ends_neither_the_run_nor_the_process(
    where: str, raised: BaseException
) -> None:
    run = Run(ends(where, raised), DeclaredClock(0.0), 50.0)
    assert run.guard.ticks == [float(k) for k in range(1, 51)]
    assert [a[:24] for a in run.alarms] == [f"recovery failed ({k} of 3)" for k in (1, 2, 3)] and len(run.lost) == 1


@pytest.mark.parametrize("what", ["everything is cancelled", "the event loop is stopped", "the event loop is closed"])
def test_who_spoils_the_event_loop_is_a_bug(what: str) -> None:
    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            match what:
                case "everything is cancelled":
                    cancels_everything()
                case "the event loop is stopped":
                    asyncio.get_running_loop().stop()
                case _:
                    asyncio.get_running_loop().close()
            await asyncio.sleep(WAIT_S)

        while (o := await desk.next()) is not None:
            if o.now_s % 5.0 == 0.0:
                await desk.think(work())

    run = Run(recovery, DeclaredClock(0.0), 50.0)
    assert len(run.guard.ticks) == 50 and len(run.alarms) == 3 and len(run.lost) == 1


def test_only_what_the_exchange_has_ordered_counts_as_overtaken() -> None:
    """The first thought is overtaken, at 8 s; the second one says that it was cancelled, and nobody has done so."""
    ended: list[bool] = []
    guard = Scripted()
    guard.mode_at = {8.0: Mode.ADVISE}

    async def recovery(desk: Exchange) -> None:
        async def first() -> None:
            await desk.since(0.0)  # 10 s are charged

        async def second() -> None:
            raise asyncio.CancelledError("of its own")

        while (o := await desk.next()) is not None:
            if o.now_s == 5.0:
                ended.append(await desk.think(first()))
            if o.now_s == 15.0:
                ended.append(await desk.think(second()))

    run = Run(recovery, DeclaredClock(10.0), 40.0, guard=guard)
    assert ended == [False] and run.lost == []
    (alarm,) = run.alarms
    assert "cancelled" in alarm and "nothing has overtaken" in alarm


def test_what_is_thought_when_the_run_ends_is_no_bug() -> None:
    async def recovery(desk: Exchange) -> None:
        async def work() -> None:
            await desk.since(0.0)

        while (o := await desk.next()) is not None:
            if o.now_s == 15.0:
                await desk.think(work())

    run = Run(recovery, DeclaredClock(100.0))
    assert run.ended and run.alarms == run.lost == []
