"""A plant that somebody watches: everything passes through unchanged, and every snapshot is shown to the watcher."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import TypeAlias, final

from homeostat.domain.ports import Plant
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot

Watcher: TypeAlias = Callable[[Snapshot], None]
"""Called with each snapshot before whoever iterates over the snapshots sees it."""

PAUSE = 50
"""Snapshots between two moments at which a simulated plant, which never waits, lets a cancellation through."""


@final
class WatchedPlant:
    """Implements :class:`homeostat.domain.ports.Plant` over another plant; it can be stopped from outside."""

    def __init__(self, plant: Plant, watcher: Watcher | None = None) -> None:
        """``watcher`` is shown every snapshot; nobody where None."""
        self._plant = plant
        self._watcher = watcher

    async def snapshots(self) -> AsyncIterator[Snapshot]:
        """The plant's snapshots."""
        given = 0
        async for snapshot in self._plant.snapshots():
            if self._watcher is not None:
                self._watcher(snapshot)
            given += 1
            if given % PAUSE == 0:
                await asyncio.sleep(0)
            yield snapshot

    async def since(self, at_s: float) -> tuple[Snapshot, ...]:
        """Every snapshot taken after ``at_s`` [s]."""
        return await self._plant.since(at_s)

    async def write(self, commands: tuple[Command, ...]) -> None:
        """Send commands."""
        await self._plant.write(commands)
