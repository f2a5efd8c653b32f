"""What the outside world must provide."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Protocol

from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Verdict


class Plant(Protocol):
    """The process and its basic control system: it can be watched, and the gate may command it."""

    def snapshots(self) -> AsyncIterator[Snapshot]:
        """Every snapshot as it is taken, until the plant is shut off."""
        ...

    async def since(self, at_s: float) -> tuple[Snapshot, ...]:
        """Every snapshot taken after process time ``at_s``, the freshest last; never empty."""
        ...

    async def write(self, commands: tuple[Command, ...]) -> None:
        """Send commands, all of them; only the gate calls this."""
        ...


class Clock(Protocol):
    """Process time that passes while agents think."""

    def start(self) -> None:
        """Thinking begins."""
        ...

    def stop(self) -> None:
        """Thinking ends."""
        ...

    def collect_s(self) -> float:
        """Process seconds that thinking took since the last call [s]; 0 outside thinking."""
        ...

    def wall_s(self, process_s: float) -> float:
        """Wall-clock seconds after which thinking that may take ``process_s`` is cut off [s]."""
        ...


class Rehearsal(Protocol):
    """Repeats the rollout of an action set from a fresh snapshot and judges it."""

    def rehearse(self, fresh: tuple[Snapshot, ...], actions: ActionSet) -> Verdict:
        """The verdict after the ``fresh`` snapshots, under the diagnosis that the approval was given for."""
        ...
