"""What the outside world must provide."""

from collections.abc import Coroutine
from typing import Any, ClassVar, Protocol

from homeostat.domain.observation import Message, Observation
from homeostat.domain.recovery import Command
from homeostat.domain.request import Answer, Request
from homeostat.domain.snapshot import Snapshot


class Clock(Protocol):
    """Process time that passes while agents think."""

    measured: bool
    """Whether it charges as the wall clock runs; else a stretch of thinking costs what was declared."""
    hang_s: float
    """Wall-clock time after which one answer is taken to hang [s]; infinite where the time that is left ends it."""

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


class GuardEvent(Protocol):
    """Something that happened: a frozen dataclass whose class names its kind."""

    kind: ClassVar[str]
    """Name of the event in the journal."""


class Kept(OSError):
    """A record has no room for an event, keeps it and stores it later by itself; nobody needs to record it again."""


class GuardTrace(Protocol):
    """Where the guard's events go, a trace in its eyes; it may fail and it may hang, and the guard goes on."""

    def record(self, event: GuardEvent, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]; Kept where that must wait for room."""
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

    @property
    def void(self) -> bool:
        """Whether the plant says that the lease is over; False from a link that cannot say so: it has its heartbeat.

        Asked once per tick, and may raise: then nothing is known of it.
        """
        ...

    def send(self, commands: tuple[Command, ...]) -> Ticket:
        """Begin to write ``commands``, in order; returns at once where the lease says so, and may raise.

        Where a lease may block, a fallback is sent from another thread while an earlier call still hangs.
        """
        ...


class Lease(Protocol):
    """The right to write to a plant; any call may raise."""

    @property
    def never_blocks(self) -> bool:
        """Whether every call, also those of its wires and their tickets, returns at once, whatever the plant does.

        Only what computes in this process may say so, as a plant in virtual time does: the guard calls it directly.
        Whatever waits for a network must not: it is called from threads that are left behind where it hangs, at
        most one call of a kind at a time.
        """
        ...

    def take(self) -> Wire:
        """Take the lease; raises where the plant does not give it."""
        ...

    def beat(self) -> None:
        """Say that the guard is alive; the plant sheds to its local setpoints where this stops."""
        ...

    def give_back(self) -> None:
        """Stop the heartbeat; the plant's own control carries on."""
        ...


class Source(Protocol):
    """The reading side of a link: one sample per tick, or none; anything in it may raise, and the guard goes on."""

    @property
    def never_blocks(self) -> bool:
        """As :attr:`Lease.never_blocks`; where it may block, a tick waits for it for a bounded time only."""
        ...

    @property
    def now_s(self) -> float:
        """Process time of the last tick [s]."""
        ...

    @property
    def ended(self) -> bool:
        """Whether there is no further tick."""
        ...

    def advance(self) -> Snapshot | None:
        """Go on by one tick; its sample, or None where none came; may raise."""
        ...


class Link(Lease, Protocol):
    """A plant from outside: its samples, and the right to write to it."""

    @property
    def source(self) -> Source:
        """The reading side."""
        ...


class Desk(Protocol):
    """Where recovery sits: observations come in, messages go out, and thinking is charged."""

    async def next(self) -> Observation | None:
        """The next observation, each one once and in order; None when there is no further one."""
        ...

    async def since(self, at_s: float) -> tuple[Observation, ...]:
        """Every observation after process time ``at_s``, at least the freshest; charged thinking time passes first."""
        ...

    @property
    def behind(self) -> bool:
        """Whether observations wait that were not given yet."""
        ...

    def put(self, message: Message) -> None:
        """Send ``message`` to the guard; what was overtaken sends nothing."""
        ...

    async def ask(self, request: Request, within_s: float) -> Answer:
        """The final answer to ``request``, which is withdrawn after ``within_s`` [s]; TimeoutError where none comes."""
        ...

    async def think(self, work: Coroutine[Any, Any, None]) -> bool:
        """Do ``work`` as charged thinking; whether it came to its end before something overtook it."""
        ...

    @property
    def hang_s(self) -> float:
        """Wall-clock time after which one answer is taken to hang [s]; infinite where the time that is left ends it."""
        ...

    def wall_s(self, process_s: float) -> float:
        """Wall-clock seconds after which thinking that may take ``process_s`` is cut off [s]."""
        ...
