"""Links in virtual time: whoever reads the next sample lets the plant run on by one tick."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, TypeAlias, final

from homeostat.domain.ports import Source
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot

Recipe: TypeAlias = Callable[[Snapshot], tuple[Command, ...]]
"""The plant's own sequence: what it commands after each sample."""


class VirtualPlant(Protocol):
    """A process with its ramps: what a link in virtual time is laid over."""

    @property
    def now_s(self) -> float:
        """Process time [s]."""
        ...

    @property
    def end_s(self) -> float:
        """Process time at which the run ends [s]."""
        ...

    @property
    def accepted(self) -> Mapping[str, float | None]:
        """Writable tag -> the target that was accepted last, in the tag's unit; None for automatic."""
        ...

    @property
    def manual(self) -> frozenset[str]:
        """Writable tags that may be handed back to automatic."""
        ...

    def command(self, commands: tuple[Command, ...]) -> None:
        """Ramp to ``commands`` from the next tick on; ValueError, and none is taken, where one cannot be."""
        ...

    def advance(self) -> Mapping[str, float]:
        """One tick later: tag -> reading in the tag's unit."""
        ...


class VirtualSource(Source, Protocol):
    """The reading side of a link in virtual time: nothing in it can command the plant."""

    @property
    def end_s(self) -> float:
        """Process time at which the run ends [s]."""
        ...


@dataclass(frozen=True, slots=True)
class Arrival:
    """Commands that arrived on a plant's wire."""

    at_s: float
    """Process time [s]."""
    commands: tuple[Command, ...]
    """What arrived, in order."""
    error: str = ""
    """What the sender was told of it; empty where nothing went wrong."""


@dataclass(frozen=True, slots=True)
class Answered:
    """Implements :class:`homeostat.domain.ports.Ticket` for a write that will say no more than it does now."""

    done: bool = True
    """Whether the link has answered."""
    error: str = ""
    """What went wrong; empty where nothing did."""


@final
class SourceView:
    """Implements :class:`VirtualSource` over a link, and shows nothing else of it."""

    __slots__ = ("_source",)

    def __init__(self, source: VirtualSource) -> None:
        """The reading side of ``source``."""
        self._source = source

    @property
    def never_blocks(self) -> bool:
        """Whether every call returns at once."""
        return self._source.never_blocks

    @property
    def now_s(self) -> float:
        """Process time [s]."""
        return self._source.now_s

    @property
    def end_s(self) -> float:
        """Process time at which the run ends [s]."""
        return self._source.end_s

    @property
    def ended(self) -> bool:
        """Whether there is nothing more to read."""
        return self._source.ended

    def advance(self) -> Snapshot | None:
        """One tick later: the sample, None where none came."""
        return self._source.advance()
