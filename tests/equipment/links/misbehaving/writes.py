"""What can be wrong with writes: small frozen sentences of a script, each with the time during which it holds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol, TypeAlias

from homeostat.domain.ports import Ticket
from homeostat.domain.recovery import Command
from homeostat.links.errors import LinkError
from homeostat.links.virtual import Answered


class Delivery(Protocol):
    """The way on to the plant."""

    def deliver(self, commands: tuple[Command, ...]) -> Ticket:
        """The plant gets ``commands`` now."""
        ...

    def postpone(self, commands: tuple[Command, ...], by_s: float) -> None:
        """The plant gets ``commands`` in ``by_s`` seconds, if the lease still lasts."""
        ...

    def pretend(self, commands: tuple[Command, ...]) -> None:
        """The plant does not get ``commands``, and reads back as if it had."""
        ...

    def answer_in(self, ticket: Ticket, by_s: float) -> Ticket:
        """``ticket`` as it comes back ``by_s`` seconds from now."""
        ...


@dataclass(frozen=True, slots=True)
class HangingWrite:
    """A write is never answered."""

    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""
    delivered: bool = False
    """Whether the plant gets the commands all the same."""

    def write(self, commands: tuple[Command, ...], way: Delivery) -> Ticket:
        """A ticket that is never done."""
        if self.delivered:
            way.deliver(commands)
        return Answered(done=False)


@dataclass(frozen=True, slots=True)
class FailingWrite:
    """A write breaks, at once, half way or when everything is done."""

    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""
    count: int | None = 0
    """How many commands arrive before it breaks; None for all."""
    raises: bool = True
    """Whether the wire raises; else the ticket says what is wrong."""

    def write(self, commands: tuple[Command, ...], way: Delivery) -> Ticket:
        """LinkError or a ticket with an error."""
        way.deliver(commands[: self.count])
        error = "the link broke during the write; how much of it arrived is not known"
        if self.raises:
            raise LinkError(error)
        return Answered(error=error)


@dataclass(frozen=True, slots=True)
class HalfWrite:
    """Only the first commands arrive, and the answer is good."""

    count: int
    """How many."""
    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""

    def write(self, commands: tuple[Command, ...], way: Delivery) -> Ticket:
        """A good answer."""
        way.deliver(commands[: self.count])
        return Answered()


@dataclass(frozen=True, slots=True)
class Disobedient:
    """Commands to some tags are not taken, and the answer is good."""

    tags: frozenset[str]
    """Which; empty for all."""
    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""
    pretends: bool = False
    """Whether the plant reads back as if it had accepted them."""

    def write(self, commands: tuple[Command, ...], way: Delivery) -> Ticket:
        """A good answer, unless the plant refuses the other commands."""
        ignored = tuple(c for c in commands if not self.tags or c.tag in self.tags)
        if self.pretends:
            way.pretend(ignored)
        return way.deliver(tuple(c for c in commands if c not in ignored))


@dataclass(frozen=True, slots=True)
class Clamped:
    """The plant brings a target into a range of its own and says nothing of it."""

    tag: str
    """Which."""
    low: float
    """Least target, in the tag's unit."""
    high: float
    """Largest target, in the tag's unit."""
    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""

    def write(self, commands: tuple[Command, ...], way: Delivery) -> Ticket:
        """The plant's answer."""
        return way.deliver(tuple(map(self._clamp, commands)))

    def _clamp(self, command: Command) -> Command:
        if command.tag != self.tag or command.value is None:
            return command
        return replace(command, value=min(max(command.value, self.low), self.high))


@dataclass(frozen=True, slots=True)
class Late:
    """The plant obeys later; the answer is good and comes at once."""

    by_s: float
    """How much later [s]."""
    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""

    def write(self, commands: tuple[Command, ...], way: Delivery) -> Ticket:
        """A good answer."""
        way.postpone(commands, self.by_s)
        return Answered()


@dataclass(frozen=True, slots=True)
class LateAnswer:
    """The plant obeys at once; the answer comes later."""

    by_s: float
    """How much later [s]."""
    from_s: float
    """Process time from which [s]."""
    to_s: float = math.inf
    """Process time until which [s]."""

    def write(self, commands: tuple[Command, ...], way: Delivery) -> Ticket:
        """The plant's answer, later."""
        return way.answer_in(way.deliver(commands), self.by_s)


BadWrite: TypeAlias = HangingWrite | FailingWrite | HalfWrite | Disobedient | Clamped | Late | LateAnswer
"""Something that is wrong with writes for a time."""
