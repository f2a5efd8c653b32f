"""The simulated plant as a link: it runs in virtual time, and nothing but its wire commands it from outside."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import final

from homeostat.domain.mode import Side
from homeostat.domain.ports import Ticket
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LeaseVoid, PlantEnded
from homeostat.links.virtual import Answered, Arrival, Recipe, SourceView, VirtualPlant, VirtualSource

HEARTBEAT_S = 5.0
"""Process time without a heartbeat after which a plant that is sampled once per second sheds to local control [s]."""
WIRE_LOG_LENGTH = 10_000
"""Most arrivals that a link remembers; the oldest are forgotten first."""


@dataclass(frozen=True, slots=True)
class LinkConfiguration:
    """What the plant's own control system does about a guard."""

    heartbeat_s: float = HEARTBEAT_S
    """Process time without a heartbeat after which the plant sheds to local control [s]."""
    local: tuple[Command, ...] = ()
    """What local control then commands; other manual outputs go back to automatic, other setpoints stay."""
    recipe_by: Side = Side.GUARD
    """Whose recipe counts while a guard holds the lease; while none does, it is the plant's."""

    @classmethod
    def of(cls, recipe_by: Side, tick_s: float) -> LinkConfiguration:
        """That of a plant which is sampled every ``tick_s`` [s]: a heartbeat comes no more often than a sample."""
        return cls(HEARTBEAT_S * max(tick_s, 1.0), recipe_by=recipe_by)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.heartbeat_s) and self.heartbeat_s > 0.0):
            raise ValueError(f"heartbeat_s {self.heartbeat_s!r} must be finite and > 0 s")


@final
class SimulatedLink:
    """Implements :class:`homeostat.domain.ports.Link` in virtual time; one tick per sample, and no sample is kept."""

    def __init__(
        self, plant: VirtualPlant, configuration: LinkConfiguration = LinkConfiguration(), recipe: Recipe | None = None
    ) -> None:
        """``recipe`` sees every sample; what it commands is the plant's own doing and not in the wire log.

        ValueError where a local setpoint cannot be commanded.
        """
        for c in configuration.local:
            if c.tag not in plant.accepted:
                raise ValueError(
                    f"local setpoint {c.tag!r} cannot be commanded; these can: {', '.join(plant.accepted)}"
                )
            if c.value is None and c.tag not in plant.manual:
                raise ValueError(f"local setpoint {c.tag!r} has no automatic mode; give a value")
        self._plant, self._configuration, self._recipe = plant, configuration, recipe
        self._lease, self._leased, self._beat_s = 0, False, math.inf
        self._shed = self._broken = False
        self._wire_log: deque[Arrival] = deque(maxlen=WIRE_LOG_LENGTH)
        self.source: VirtualSource = SourceView(self)
        """The reading side alone."""

    @property
    def never_blocks(self) -> bool:
        """It computes in this process, and waits for nothing outside it."""
        return True

    @property
    def now_s(self) -> float:
        """Process time [s]."""
        return self._plant.now_s

    @property
    def end_s(self) -> float:
        """Process time at which the run ends [s]."""
        return self._plant.end_s

    @property
    def ended(self) -> bool:
        """Whether the run is over: its end is reached, or the plant broke."""
        return self._broken or self.now_s >= self.end_s

    @property
    def wire_log(self) -> tuple[Arrival, ...]:
        """What arrived on the wire, the oldest first."""
        return tuple(self._wire_log)

    @property
    def shed(self) -> bool:
        """Whether local control has taken over because the guard is gone; a new lease ends it."""
        return self._shed

    @property
    def leased(self) -> bool:
        """Whether a guard holds the lease."""
        return self._leased

    def advance(self) -> Snapshot:
        """The sample one tick later; PlantEnded after the end, and whatever the plant raises where it breaks."""
        if self.ended:
            raise PlantEnded(f"the run is over since t = {self.now_s:.10g} s; there is no further sample")
        if self.now_s - self._beat_s >= self._configuration.heartbeat_s:
            self._shed_to_local()
        try:
            values = self._plant.advance()
        except Exception:
            self._broken = True
            raise
        snapshot = Snapshot(self.now_s, values, accepted=self._plant.accepted)
        if self._recipe is not None:
            commands = self._recipe(snapshot)  # it follows the plant also while the guard's recipe counts
            if commands and (not self._leased or self._configuration.recipe_by is Side.PLANT):
                self._plant.command(commands)
        return replace(snapshot, accepted=self._plant.accepted)

    def take(self) -> SimulatedWire:
        """Take the lease; the wire of whoever held it is void from now on."""
        self._lease += 1
        self._leased, self._beat_s, self._shed = True, math.inf, False
        return SimulatedWire(self._deliver, partial(self._holds, self._lease))

    def beat(self) -> None:
        """The guard is alive; from the first time on it must say so. Before the first lease it changes nothing.

        LeaseVoid where local control has taken over meanwhile.
        """
        if self._shed:
            raise LeaseVoid("the plant's own control has taken over; take a new lease")
        if self._leased:
            self._beat_s = self.now_s

    def give_back(self) -> None:
        """The heartbeat stops and local control takes over; where nobody holds the lease, nothing happens."""
        if self._leased:
            self._shed_to_local()

    def operate(self, tag: str, value: float | None, rate: float | None = None) -> None:
        """Somebody at the plant moves ``tag``; ValueError where it cannot be."""
        self._plant.command((Command(tag, value, rate),))

    def _holds(self, lease: int) -> bool:
        return self._leased and lease == self._lease

    def _deliver(self, commands: tuple[Command, ...]) -> Ticket:
        error = ""
        try:
            self._plant.command(commands)
        except ValueError as refused:
            error = str(refused)
        self._wire_log.append(Arrival(self.now_s, commands, error))
        return Answered(error=error)

    def _shed_to_local(self) -> None:
        local = self._configuration.local
        named = {c.tag for c in local}
        held = [tag for tag, target in self._plant.accepted.items() if target is not None and tag not in named]
        self._plant.command((*local, *(Command(tag, None, None) for tag in held if tag in self._plant.manual)))
        self._leased, self._beat_s, self._shed = False, math.inf, True


@final
class SimulatedWire:
    """Implements :class:`homeostat.domain.ports.Wire` for one lease."""

    __slots__ = ("_deliver", "_holds")

    def __init__(self, deliver: Callable[[tuple[Command, ...]], Ticket], holds: Callable[[], bool]) -> None:
        """``deliver`` hands commands to the plant; ``holds``: whether the lease lasts."""
        self._deliver, self._holds = deliver, holds

    @property
    def void(self) -> bool:
        """Whether the lease is over."""
        return not self._holds()

    def send(self, commands: tuple[Command, ...]) -> Ticket:
        """Write ``commands``: all of them, or none and the ticket says why; LeaseVoid where the lease is over."""
        if self.void:
            raise LeaseVoid("the lease of this wire is over, and nothing was written; take a new one")
        return self._deliver(commands)
