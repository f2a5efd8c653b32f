"""What every plant must do, simulated or real. A test class inherits this and says how to open its plant."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Callable
from itertools import pairwise
from typing import TypeAlias

import pytest

from homeostat.domain.ports import Plant
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from tests.contracts.link import Handles, equal

Open: TypeAlias = Callable[[], Plant]
"""Opens the plant under test; every call a fresh one. Called with an event loop running."""


async def take(stream: AsyncIterator[Snapshot], count: int) -> list[Snapshot]:
    """The next ``count`` snapshots, fewer where the plant is shut off."""
    found: list[Snapshot] = []
    async for snapshot in stream:
        found.append(snapshot)
        if len(found) == count:
            break
    return found


class PlantContract:
    """Inherit, and provide the fixtures ``opened`` and ``handles``."""

    def test_snapshots_come_in_order_with_every_tag(self, opened: Open, handles: Handles) -> None:
        async def story() -> None:
            found = await take(opened().snapshots(), 20)
            times = [s.at_s for s in found]
            assert len(found) == 20 and times == sorted(set(times))
            names = set(found[0].values)
            assert {handles.setpoint, handles.manual, handles.reading} <= names
            for s in found:
                assert set(s.values) == names
                assert {n for n, v in s.values.items() if not math.isfinite(v)} <= {
                    n for n, v in found[0].values.items() if math.isnan(v)
                }

        asyncio.run(story())

    def test_since_is_never_empty_and_ends_with_the_freshest(self, opened: Open) -> None:
        async def story() -> None:
            plant = opened()
            first = await plant.since(0.0)
            assert first
            seen = (await take(plant.snapshots(), len(first) + 10))[-1].at_s
            for at_s in (0.0, seen - 3.0, seen - 0.5, seen, seen + 100.0):
                found = await plant.since(at_s)
                times = [s.at_s for s in found]
                assert times == sorted(set(times)) and times[-1] >= seen
                assert all(t > at_s for t in times) or len(found) == 1, "without news, the freshest one alone"

        asyncio.run(story())

    def test_snapshots_and_since_tell_the_same(self, opened: Open) -> None:
        async def story() -> None:
            plant = opened()
            found = await take(plant.snapshots(), 12)
            again = {s.at_s: s.values for s in await plant.since(0.0)}
            for s in found:
                assert all(equal(v, again[s.at_s][n]) for n, v in s.values.items())

        asyncio.run(story())

    def test_without_commands_no_input_moves(self, opened: Open, handles: Handles) -> None:
        async def story() -> None:
            plant = opened()
            found = await take(plant.snapshots(), 15)
            await plant.since(3.0)
            await plant.write(())
            found += await take(plant.snapshots(), 20)
            for tag in (handles.setpoint, handles.manual):
                assert all(equal(s.values[tag], found[0].values[tag]) for s in found)

        asyncio.run(story())

    def test_a_setpoint_is_ramped_to_its_value_and_stays(self, opened: Open, handles: Handles) -> None:
        async def story() -> None:
            plant = opened()
            before = (await take(plant.snapshots(), 5))[-1]
            start = before.values[handles.setpoint]
            await plant.write((Command(handles.setpoint, start + handles.move, handles.rate),))
            path = [start]
            for _ in range(12):
                path.append((await self.next(plant, before)).values[handles.setpoint])
                before = (await plant.since(before.at_s))[0]
            steps = [b - a for a, b in pairwise(path)]
            direction = math.copysign(1.0, handles.move)
            assert all(-1e-9 <= s * direction <= handles.rate * (1.0 + 1e-9) for s in steps), path
            assert path[-1] == start + handles.move and path[1] != path[-1]

        asyncio.run(story())

    async def next(self, plant: Plant, before: Snapshot) -> Snapshot:
        """The first snapshot after ``before``."""
        async for s in plant.snapshots():
            if s.at_s > before.at_s:
                return s
        raise AssertionError("the plant was shut off")

    async def later(self, plant: Plant, after: Snapshot, count: int) -> Snapshot:
        """The ``count``-th snapshot after ``after``."""
        for _ in range(count):
            after = await self.next(plant, after)
        return after

    def test_a_command_sent_twice_is_a_command_sent_once(self, opened: Open, handles: Handles) -> None:
        async def story(times: int) -> float:
            plant = opened()
            before = (await take(plant.snapshots(), 5))[-1]
            goal = before.values[handles.setpoint] + handles.move
            for _ in range(times):
                await plant.write((Command(handles.setpoint, goal, None),))
            reached = (await self.later(plant, before, 3)).values[handles.setpoint]
            assert reached == goal
            return reached

        assert asyncio.run(story(1)) == asyncio.run(story(2))

    def test_a_manual_output_is_taken_and_handed_back(self, opened: Open, handles: Handles) -> None:
        async def story() -> None:
            plant = opened()
            before = (await take(plant.snapshots(), 5))[-1]
            assert math.isnan(before.values[handles.manual])
            await plant.write((Command(handles.manual, 0.4, None),))
            held = await self.later(plant, before, 3)
            assert held.values[handles.manual] == 0.4
            await plant.write((Command(handles.manual, None, None),))
            assert math.isnan((await self.later(plant, held, 3)).values[handles.manual])

        asyncio.run(story())

    @pytest.mark.parametrize("bad", ["reading", "unknown", "automatic setpoint"])
    def test_commands_are_taken_all_or_none(self, opened: Open, handles: Handles, bad: str) -> None:
        refused = {
            "reading": Command(handles.reading, 1.0, None),
            "unknown": Command("no such tag", 1.0, None),
            "automatic setpoint": Command(handles.setpoint, None, None),
        }[bad]

        async def story() -> None:
            plant = opened()
            before = (await take(plant.snapshots(), 5))[-1]
            with pytest.raises(ValueError, match=repr(refused.tag)):
                await plant.write((Command(handles.manual, 0.4, None), refused))
            after = await self.later(plant, before, 3)
            assert math.isnan(after.values[handles.manual])
            assert after.values[handles.setpoint] == before.values[handles.setpoint]

        asyncio.run(story())
