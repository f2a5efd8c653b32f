"""The writing side of a link that misbehaves by a script."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import final

from homeostat.domain.ports import Ticket, Wire
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.errors import LinkError
from homeostat.links.simulated import WIRE_LOG_LENGTH
from homeostat.links.virtual import Answered, Arrival
from tests.equipment.links.misbehaving.writes import BadWrite
from tests.equipment.links.timetable import Timetable
from tests.equipment.links.virtual import VirtualLink


@dataclass(frozen=True, slots=True)
class _LateTicket:
    """Implements :class:`homeostat.domain.ports.Ticket` for an answer that takes its time."""

    ticket: Ticket
    """The answer."""
    arrived: Callable[[], bool]
    """Whether it is there."""

    @property
    def done(self) -> bool:
        """Whether the link has answered."""
        return self.arrived() and self.ticket.done

    @property
    def error(self) -> str:
        """What went wrong, as far as it is known."""
        return self.ticket.error if self.done else ""


class WriteSide:
    """What all wires of one misbehaving link share."""

    def __init__(self, link: VirtualLink, script: tuple[BadWrite, ...], block: Callable[[], None]) -> None:
        """``link`` is the one beneath; ``block`` returns when a write may begin."""
        self._link, self.block = link, block
        self._script = Timetable(script)
        self._late: list[tuple[float, tuple[Command, ...], Wire]] = []
        self._pretended: dict[str, float | None] = {}
        self.log: deque[Arrival] = deque(maxlen=WIRE_LOG_LENGTH)
        """What was handed to any wire, the oldest first."""

    @property
    def now_s(self) -> float:
        """Process time [s]."""
        return self._link.now_s

    def decides(self) -> BadWrite | None:
        """What happens to writes now; None where they go through."""
        self._script.move(self.now_s)
        return self._script.active[0] if self._script.active else None

    def postpone(self, commands: tuple[Command, ...], at_s: float, wire: Wire) -> None:
        """``commands`` reach the plant at process time ``at_s`` [s]."""
        self._late.append((at_s, commands, wire))

    def deliver_late(self) -> None:
        """What is due reaches the plant, unless its lease is over."""
        due = [late for late in self._late if late[0] <= self.now_s]
        self._late = [late for late in self._late if late[0] > self.now_s]
        for _, commands, wire in due:
            if not wire.void:
                wire.send(commands)
                self.obeyed(commands)

    def pretend(self, commands: tuple[Command, ...]) -> None:
        """Read ``commands`` back as if the plant had accepted them."""
        self._pretended.update({c.tag: c.value for c in commands})

    def obeyed(self, commands: tuple[Command, ...]) -> None:
        """``commands`` were carried out: nothing is pretended of their tags."""
        for c in commands:
            self._pretended.pop(c.tag, None)

    def read_back(self, sample: Snapshot) -> Snapshot:
        """``sample`` with the targets that are pretended; local control ends every pretence."""
        if self._link.shed:
            self._pretended.clear()
        return replace(sample, accepted={**sample.accepted, **self._pretended}) if self._pretended else sample


@final
class MisbehavingWire:
    """Implements the port ``Wire`` of the domain and :class:`~tests.equipment.links.misbehaving.writes.Delivery`."""

    def __init__(self, side: WriteSide, wire: Wire) -> None:
        """``wire`` is the one beneath."""
        self._side, self._wire = side, wire

    @property
    def void(self) -> bool:
        """Whether the lease is over."""
        return self._wire.void

    def send(self, commands: tuple[Command, ...]) -> Ticket:
        """Write ``commands``, or whatever the script makes of it; LeaseVoid where the lease is over."""
        if self.void:
            return self._wire.send(commands)  # which raises
        self._side.block()
        bad, error = self._side.decides(), ""
        try:
            ticket = self.deliver(commands) if bad is None else bad.write(commands, self)
            error = ticket.error
        except LinkError as broken:
            error = str(broken)
            raise
        finally:
            self._side.log.append(Arrival(self._side.now_s, commands, error))
        return ticket

    def deliver(self, commands: tuple[Command, ...]) -> Ticket:
        """The plant gets ``commands`` now."""
        if not commands:
            return Answered()
        ticket = self._wire.send(commands)
        if not ticket.error:
            self._side.obeyed(commands)
        return ticket

    def postpone(self, commands: tuple[Command, ...], by_s: float) -> None:
        """The plant gets ``commands`` in ``by_s`` seconds, if the lease still lasts."""
        self._side.postpone(commands, self._side.now_s + by_s, self._wire)

    def pretend(self, commands: tuple[Command, ...]) -> None:
        """The plant does not get ``commands``, and reads back as if it had."""
        self._side.pretend(commands)

    def answer_in(self, ticket: Ticket, by_s: float) -> Ticket:
        """``ticket`` as it comes back ``by_s`` seconds from now."""
        at_s = self._side.now_s + by_s
        return _LateTicket(ticket, lambda: self._side.now_s >= at_s)
