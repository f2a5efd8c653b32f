"""A link that misbehaves by a script: attacks on whoever believes samples and trusts writes."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Literal, TypeAlias, final

from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LinkError
from homeostat.links.virtual import Arrival, SourceView, VirtualSource
from tests.equipment.links.misbehaving.readings import BadReading
from tests.equipment.links.misbehaving.wire import MisbehavingWire, WriteSide
from tests.equipment.links.misbehaving.writes import BadWrite
from tests.equipment.links.timetable import Timetable
from tests.equipment.links.virtual import VirtualLink


@dataclass(frozen=True, slots=True)
class ByHand:
    """Somebody at the plant moves a tag, after the sample of that time and before the next one."""

    tag: str
    """Which."""
    value: float | None
    """Where to, in the tag's unit; None for automatic."""
    at_s: float
    """Process time [s]."""
    rate: float | None = None
    """Fastest change in unit per second; None for a step."""

    @property
    def from_s(self) -> float:
        """When it happens [s]."""
        return self.at_s

    @property
    def to_s(self) -> float:
        """It is over at once [s]."""
        return self.at_s


@dataclass(frozen=True, slots=True)
class NoLease:
    """The plant does not give the lease."""

    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""


@dataclass(frozen=True, slots=True)
class LostHeartbeat:
    """Heartbeats do not arrive."""

    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""


@dataclass(frozen=True, slots=True)
class Blocking:
    """A call does not come back for a while, as in a network stack; then it goes on as if nothing had been."""

    call: Literal["advance", "take", "beat", "give_back", "send"]
    """Which."""
    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""
    wall_s: float = 60.0
    """How long each call takes, wall-clock [s]."""


Misbehaviour: TypeAlias = BadReading | BadWrite | ByHand | NoLease | LostHeartbeat | Blocking
"""A sentence of a script."""


@final
class Misbehaving:
    """A `VirtualLink` over another one; without a script nothing is changed.

    Its wire log is what was handed to the wire; what arrived at the plant is in the log of the link beneath.
    """

    def __init__(self, link: VirtualLink, script: tuple[Misbehaviour, ...]) -> None:
        """``script`` in any order; of write misbehaviours that hold together, the first decides."""
        self._link = link
        self._readings = Timetable(m for m in script if isinstance(m, BadReading))
        writes = tuple(m for m in script if isinstance(m, BadWrite))
        self._writes = WriteSide(link, writes, lambda: self._block("send"))
        self._hands = Timetable(m for m in script if isinstance(m, ByHand))
        self._refusals = Timetable(m for m in script if isinstance(m, NoLease))
        self._deaf = Timetable(m for m in script if isinstance(m, LostHeartbeat))
        self._blocks = Timetable(m for m in script if isinstance(m, Blocking))
        self._may_block = any(isinstance(m, Blocking) for m in script)
        self._held: dict[BadReading, Snapshot] = {}
        self._last: Snapshot | None = None
        self.source: VirtualSource = SourceView(self)
        """The reading side alone."""

    @property
    def never_blocks(self) -> bool:
        """Whether the script has nothing that blocks."""
        return self._link.never_blocks and not self._may_block

    @property
    def now_s(self) -> float:
        """Process time [s]."""
        return self._link.now_s

    @property
    def end_s(self) -> float:
        """Process time at which the run ends [s]."""
        return self._link.end_s

    @property
    def ended(self) -> bool:
        """Whether there is nothing more to read."""
        return self._link.ended

    @property
    def wire_log(self) -> tuple[Arrival, ...]:
        """What was handed to the wire, the oldest first."""
        return tuple(self._writes.log)

    @property
    def shed(self) -> bool:
        """Whether the plant's own control has taken over because the guard is gone."""
        return self._link.shed

    def advance(self) -> Snapshot | None:
        """The sample one second later, as the script lets it through; it raises where the script says so."""
        self._block("advance")
        for hand in self._hands.move(self.now_s):
            self.operate(hand.tag, hand.value, hand.rate)
        self._writes.deliver_late()
        sample = self._link.advance()
        before, self._last = self._last or sample, sample
        for begun in self._readings.move(self.now_s):
            if before is not None:
                self._held[begun] = before
        if sample is not None:
            sample = self._writes.read_back(sample)
        for bad in self._readings.active:
            if sample is not None:
                sample = bad.distort(sample, self._held.get(bad, sample))
        return sample

    def take(self) -> MisbehavingWire:
        """Take the lease; LinkError where the script does not give it."""
        self._block("take")
        self._refusals.move(self.now_s)
        if self._refusals.active:
            raise LinkError(f"the plant does not give the lease at t = {self.now_s:.0f} s")
        return MisbehavingWire(self._writes, self._link.take())

    def beat(self) -> None:
        """The guard is alive, unless that gets lost."""
        self._block("beat")
        self._deaf.move(self.now_s)
        if not self._deaf.active:
            self._link.beat()

    def give_back(self) -> None:
        """The heartbeat stops; local control takes over."""
        self._block("give_back")
        self._link.give_back()

    def operate(self, tag: str, value: float | None, rate: float | None = None) -> None:
        """Somebody at the plant moves ``tag``."""
        self._link.operate(tag, value, rate)
        self._writes.obeyed((Command(tag, value, rate),))

    def _block(self, call: str) -> None:
        self._blocks.move(self.now_s)
        for blocking in self._blocks.active:
            if blocking.call == call:
                time.sleep(blocking.wall_s)
