"""What the outside world must provide."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import ClassVar, Protocol

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


class GuardEvent(Protocol):
    """Something that happened: a frozen dataclass whose class names its kind."""

    kind: ClassVar[str]
    """Name of the event in the journal."""


class Record(Protocol):
    """Where the guard's events go; it may fail and it may hang, and the guard goes on."""

    def record(self, event: GuardEvent, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]."""
        ...

    def sync(self) -> None:
        """Return when everything that was recorded is safe from a power cut."""
        ...


class Ticket(Protocol):
    """A write that is under way."""

    @property
    def done(self) -> bool:
        """Whether the link has answered."""
        ...

    @property
    def error(self) -> str:
        """What went wrong; empty where nothing did."""
        ...


class Wire(Protocol):
    """The writing side of a link: held by the guard's one writer, and only in modes that write."""

    def send(self, commands: tuple[Command, ...]) -> Ticket:
        """Begin to write ``commands``, in order; returns at once, and may raise."""
        ...


class Lease(Protocol):
    """The right to write to a plant."""

    def take(self) -> Wire:
        """Take the lease; raises where the plant does not give it."""
        ...

    def beat(self) -> None:
        """Say that the guard is alive; the plant sheds to its local setpoints where this stops."""
        ...

    def give_back(self) -> None:
        """Stop the heartbeat; the plant's own control carries on."""
        ...
