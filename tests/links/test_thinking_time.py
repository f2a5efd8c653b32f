"""The simulated plant runs on while agents think."""

from __future__ import annotations

import asyncio
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.clock import DeclaredClock, ThinkingClock
from tests.contracts.plant import take
from tests.links.reactor_plant import everything, plant, same


def test_the_plant_runs_on_by_exactly_the_declared_seconds() -> None:
    async def story() -> None:
        clock = DeclaredClock(7.0)
        subject = plant(clock=clock)
        await take(subject.snapshots(), 10)
        for k in range(1, 4):
            clock.start()
            fresh = await subject.since(10.0 + 7.0 * (k - 1))
            clock.stop()
            assert [s.at_s for s in fresh] == [10.0 + 7.0 * (k - 1) + s for s in range(1, 8)]
            assert (await subject.since(0.0))[-1].at_s == 10.0 + 7.0 * k

    asyncio.run(story())


@settings(deadline=None, max_examples=30)
@given(st.floats(0.0, 3.0), st.integers(1, 30))
def test_many_short_thoughts_cost_what_one_long_one_costs(cost_s: float, stretches: int) -> None:
    """Whole seconds pass, never fewer than were owed, and rounding up is set off against the next stretch."""

    async def story() -> None:
        clock = DeclaredClock(cost_s)
        subject = plant(clock=clock)
        await take(subject.snapshots(), 1)
        for k in range(1, stretches + 1):
            clock.start()
            clock.stop()
            passed = (await subject.since(0.0))[-1].at_s - 1.0
            assert k * cost_s - 1e-6 <= passed < k * cost_s + 1.0

    asyncio.run(story())


def test_the_plant_runs_on_by_wall_clock_time_times_the_scale() -> None:
    async def story() -> None:
        clock = ThinkingClock(1000.0)
        subject = plant(end_s=5000.0, clock=clock)
        await take(subject.snapshots(), 5)
        clock.start()
        await asyncio.to_thread(time.sleep, 0.03)
        during = (await subject.since(5.0))[-1].at_s
        assert during >= 5.0 + 30.0
        await asyncio.to_thread(time.sleep, 0.01)
        clock.stop()
        after = (await subject.since(5.0))[-1].at_s
        assert after >= during + 9.0
        assert after - 5.0 == pytest.approx(1000.0 * clock.total_s, abs=1.0)
        await asyncio.to_thread(time.sleep, 0.01)
        assert (await subject.since(5.0))[-1].at_s == after, "it waits while nobody thinks and nobody looks"

    asyncio.run(story())


def test_time_is_charged_when_it_passed_and_not_to_the_next_recovery() -> None:
    """Thinking that ends without another look at the plant is over before the next snapshot is taken."""

    async def story() -> None:
        clock = DeclaredClock(5.0)
        subject = plant(clock=clock)
        stream = subject.snapshots()
        assert (await take(stream, 3))[-1].at_s == 3.0
        clock.start()
        clock.stop()
        assert (await anext(stream)).at_s == 4.0
        assert subject.truth().length == 8
        assert (await subject.since(4.0))[-1].at_s == 8.0

    asyncio.run(story())


@settings(deadline=None, max_examples=30)
@given(st.lists(st.tuples(st.integers(0, 12), st.sampled_from(["since", "write", "think", "truth"])), max_size=12))
def test_every_second_is_told_exactly_once_whatever_happens_between(story: list[tuple[int, str]]) -> None:
    async def act() -> list[Snapshot]:
        clock = DeclaredClock(4.0)
        subject = plant(end_s=60.0, clock=clock)
        found = []
        stream = subject.snapshots()
        await subject.since(0.0)
        for count, action in story:
            found += [s for _ in range(count) if (s := await anext(stream, None)) is not None]
            clock.start()
            if action == "since":
                await subject.since(found[-1].at_s if found else 0.0)
            elif action == "write":
                await subject.write((Command("T1.sp", 308.0, 0.5),))
            elif action == "truth":
                subject.truth()
            clock.stop()
        return found + [s async for s in stream]

    assert [s.at_s for s in asyncio.run(act())] == [float(t) for t in range(1, 61)]


def test_thinking_changes_when_the_agents_look_and_not_what_the_plant_does() -> None:
    async def thoughtful() -> list[Snapshot]:
        clock = DeclaredClock(11.0)
        subject = plant(end_s=120.0, clock=clock)
        stream = subject.snapshots()
        found = await take(stream, 20)
        clock.start()
        await subject.since(20.0)
        clock.stop()
        return found + [s async for s in stream]

    assert same(asyncio.run(thoughtful()), asyncio.run(everything(plant(end_s=120.0))))


def test_the_end_comes_also_while_agents_think() -> None:
    async def story() -> None:
        clock = DeclaredClock(1000.0)
        subject = plant(end_s=30.0, clock=clock)
        stream = subject.snapshots()
        assert len(await take(stream, 10)) == 10
        clock.start()
        fresh = await subject.since(10.0)
        clock.stop()
        assert [s.at_s for s in fresh] == [float(t) for t in range(11, 31)]
        await subject.write((Command("T1.sp", 308.0, None),))
        assert [s.at_s for s in await subject.since(30.0)] == [30.0]
        assert [s.at_s async for s in stream] == [float(t) for t in range(11, 31)]
        assert subject.truth().length == 30

    asyncio.run(story())
