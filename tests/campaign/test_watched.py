"""A watched plant is the same plant, and it can be stopped."""

from __future__ import annotations

import asyncio

import pytest

from homeostat.campaign.scenario import scenario
from homeostat.campaign.unattended import build_plant
from homeostat.campaign.watched import PAUSE, WatchedPlant
from homeostat.cases.case import load_case
from homeostat.cases.wiring import new_sequencer
from homeostat.domain.snapshot import Snapshot
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import SimulatedPlant


def plant(end_s: float) -> SimulatedPlant:
    case = load_case("cstr")
    return build_plant(case, scenario(case, "none", 1, end_s=end_s), DeclaredClock(0.0), new_sequencer(case))


def test_every_snapshot_passes_and_is_shown_first() -> None:
    shown: list[Snapshot] = []

    async def watch() -> list[tuple[float, int]]:
        return [(s.at_s, len(shown)) async for s in WatchedPlant(plant(120.0), shown.append).snapshots()]

    assert asyncio.run(watch()) == [(float(t), t) for t in range(1, 121)]


def test_a_plant_that_never_waits_can_be_cancelled() -> None:
    seen: list[Snapshot] = []

    async def watch() -> None:
        async for _ in WatchedPlant(plant(10_000.0), seen.append).snapshots():
            pass

    async def stop() -> None:
        task = asyncio.create_task(watch())
        await asyncio.sleep(0)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    asyncio.run(stop())
    assert len(seen) <= 2 * PAUSE
