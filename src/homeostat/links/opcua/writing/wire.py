"""The writing side of an OPC UA link: one call per order, read back, and never a second time by itself."""

from __future__ import annotations

import asyncio
import concurrent.futures
from collections.abc import Callable
from typing import final

from homeostat.domain.recovery import Command
from homeostat.links.errors import LeaseVoid, LinkError
from homeostat.links.opcua.connection.keeper import Keeper
from homeostat.links.opcua.connection.session import Session, status_name, told
from homeostat.links.opcua.writing.writes import Expected, NodeWrite, Translation, WriteOrder

REQUEST_S = 1.0
"""Longest that a plant with two steps may take to show what was requested, wall-clock [s]."""
AGAIN_S = 0.05
"""How often it is looked at [s]."""


@final
class OpcuaTicket:
    """Implements :class:`homeostat.domain.ports.Ticket` for a write that is under way in the connection's thread."""

    def __init__(self, future: concurrent.futures.Future[str]) -> None:
        """``future`` gives what went wrong, empty where nothing did."""
        self._future = future

    @property
    def done(self) -> bool:
        """Whether the link has answered."""
        return self._future.done()

    @property
    def error(self) -> str:
        """What went wrong; empty where nothing did."""
        if not self._future.done():
            return ""
        try:
            return self._future.result()
        except TimeoutError:
            return "the server has not answered; whether it wrote is not known, the plant is read back"
        except (Exception, concurrent.futures.CancelledError) as broken:
            return f"the link broke during the write, and how much arrived is not known: {told(broken)}"


@final
class OpcuaWire:
    """Implements :class:`homeostat.domain.ports.Wire` for one lease on one connection."""

    def __init__(
        self,
        keeper: Keeper,
        translation: Translation,
        fence: tuple[NodeWrite, ...],
        epoch: int,
        held: Callable[[], bool],
    ) -> None:
        """``fence`` goes first in each call; ``epoch``: the connection; ``held``: whether the plant shows our lease."""
        self._keeper, self._translation, self._fence, self._epoch, self._held = keeper, translation, fence, epoch, held
        self._over = False

    @property
    def void(self) -> bool:
        """Whether the lease is over: the connection is another one, or the plant shows another lease."""
        self._over = self._over or self._keeper.epoch != self._epoch or not self._held()
        return self._over

    def send(self, commands: tuple[Command, ...]) -> OpcuaTicket:
        """Begin to write ``commands`` in one call.

        LinkError where one of them may not be written, and nothing is; LeaseVoid where the lease is over.
        """
        if self.void:
            raise LeaseVoid("the lease of this wire is over, and nothing was written; take a new one")
        order = self._translation.order(commands)
        return OpcuaTicket(self._keeper.begin(lambda session: carry_out(session, order, self._fence), self._epoch))


async def carry_out(session: Session, order: WriteOrder, fence: tuple[NodeWrite, ...]) -> str:
    """Write ``order``, read it back, and apply it where that is a second step; what went wrong, empty for nothing."""
    if not order.writes:
        return ""
    if wrong := session.unfit((*fence, *order.writes, *order.applies)):
        return f"nothing was written: {wrong}"
    if wrong := _refused(order.writes, (await session.write((*fence, *order.writes)))[len(fence) :]):
        return wrong
    wrong = await _read_back(session, order.read_back)
    for _ in range(int(REQUEST_S / AGAIN_S) if order.applies else 0):
        if not wrong:
            break
        await asyncio.sleep(AGAIN_S)
        wrong = await _read_back(session, order.read_back)
    if wrong or not order.applies:
        return wrong
    return _refused(order.applies, (await session.write((*fence, *order.applies)))[len(fence) :])


def _refused(writes: tuple[NodeWrite, ...], statuses: list[str]) -> str:
    wrong = [f"{w.node} = {w.value!r}: {status}" for w, status in zip(writes, statuses, strict=True) if status]
    return f"the plant refused {'; '.join(wrong)}" if wrong else ""


async def _read_back(session: Session, expected: tuple[Expected, ...]) -> str:
    """What does not show what was written; a node that cannot be read says nothing."""
    if not expected:
        return ""
    found = await session.read([e.node for e in expected])
    for e, value in zip(expected, found, strict=True):
        if value.StatusCode is not None and not value.StatusCode.is_good():
            if "NotReadable" in status_name(int(value.StatusCode.value)):
                continue
            return (
                f"{e.tag!r} was written, and its node cannot be read back: {status_name(int(value.StatusCode.value))}"
            )
        raw = None if value.Value is None else value.Value.Value
        if not isinstance(raw, float | int) or not abs(float(raw) - e.value) <= e.tolerance:  # NaN is far from all
            return f"{e.tag!r} was written as {e.value:g}, and its node holds {raw!r}"
    return ""


def answer(future: concurrent.futures.Future[str], within_s: float, what: str) -> None:
    """Wait for ``future``; LinkError where it says that something went wrong, or nothing in ``within_s`` [s]."""
    try:
        wrong = future.result(within_s)
    except TimeoutError:
        raise LinkError(f"{what}: the server has not answered for {within_s:g} s") from None
    except LinkError:
        raise
    except Exception as broken:
        raise LinkError(f"{what}: {told(broken)}") from None
    if wrong:
        raise LinkError(f"{what}: {wrong}")
