"""A plant behind an OPC UA server, as the guard wants it: samples, a lease, and a heartbeat."""

from __future__ import annotations

import contextlib
import secrets
import time
from collections.abc import Mapping
from typing import Self, final

from homeostat.domain.plant.rules import GuardRules
from homeostat.links.errors import LeaseVoid, LinkError
from homeostat.links.opcua.connection.board import Board, NodeReading, Raw
from homeostat.links.opcua.connection.keeper import LOOK_S, Keeper
from homeostat.links.opcua.connection.session import Session
from homeostat.links.opcua.extra import need_opcua
from homeostat.links.opcua.mapping import LinkMapping
from homeostat.links.opcua.reading.process_time import ProcessTime
from homeostat.links.opcua.reading.samples import Samples
from homeostat.links.opcua.reading.source import OpcuaSource, finite_pace
from homeostat.links.opcua.security.security import Security
from homeostat.links.opcua.writing.wire import OpcuaWire, answer, carry_out
from homeostat.links.opcua.writing.writes import NodeWrite, Translation, WriteOrder

LATE_S = 2.0
"""By how much more than two publishing intervals news of the lease may be late, wall-clock [s]."""
FEWEST = 2**15 - 1
"""Largest number that a lease must be able to hold, at least: two guards draw theirs by chance [1]."""
BEAT_S = 1.0
"""Longest wait for a heartbeat to be taken, wall-clock [s]."""


@final
class OpcuaLink:
    """Implements :class:`homeostat.domain.ports.Link`; open until :meth:`close`, or as a context manager."""

    never_blocks = False
    """Its calls wait for a network, each for a bounded time."""

    def __init__(self, mapping: LinkMapping, rules: GuardRules, security: Security, pace: float = 1.0) -> None:
        """Begin to connect; nothing is waited for.

        LinkError where mapping and plant contradict each other, or the security is none; ValueError where ``pace``,
        process seconds per wall-clock second, is not finite and above 0.
        """
        need_opcua()
        security.check()
        self._mapping, self._security = mapping, security
        self._translation = Translation(mapping, rules)
        samples = Samples(mapping, rules, finite_pace(pace))
        guard = mapping.guard
        self._board = Board(guard.counter or guard.time, rules.timing.tick_s / pace)
        self._keeper = Keeper(mapping, security, self._board)
        time_ = ProcessTime(pace, rules.timing, mapping.connection.publish_s)
        self.source = OpcuaSource(self._keeper, self._board, mapping, samples, time_)
        """The reading side."""
        self._token, self._epoch, self._beats, self._taken_s = 0, -1, 0, 0.0
        self._earlier: frozenset[Raw] = frozenset()

    @property
    def trouble(self) -> str:
        """Why there is no connection, in one line; empty while there is one."""
        return "" if self._keeper.up else self._keeper.trouble

    def wait(self, within_s: float) -> None:
        """Wait for the first sample; LinkError where there is none within ``within_s`` [s], with the reason."""
        end = time.monotonic() + within_s
        while self.trouble:
            if time.monotonic() > end:
                raise LinkError(f"the plant was not reached within {within_s:g} s: {self.trouble}")
            time.sleep(LOOK_S)

    @property
    def connections(self) -> int:
        """Goes up with every connection that was up, and with every one that was lost."""
        return self._keeper.epoch

    @property
    def clock_s(self) -> float:
        """How far the server's clock is ahead of ours [s]."""
        return self._board.clock_s

    @property
    def readings(self) -> Mapping[str, NodeReading]:
        """Address -> what the server has said of that node last, with quality, source, server and own time."""
        return self._board.readings()[1]

    @property
    def acknowledged(self) -> bool:
        """Whether an operator of the plant has acknowledged our alarm; False where nobody says so."""
        shown = self._board.get(self._mapping.guard.acknowledged)
        return shown is not None and shown.value is True

    def take(self) -> OpcuaWire:
        """Take the lease, and become who writes; LinkError where the plant or the state of the link forbids it."""
        guard, epoch = self._mapping.guard, self._keeper.epoch
        self._refuse_unfit()
        token = secrets.randbits(31) | 1
        fence: tuple[NodeWrite, ...] = ()
        if guard.lease is not None:
            if (most := self._keeper.largest(guard.lease)) < FEWEST:
                which = f"the lease {guard.lease} holds no number that tells two guards apart"
                raise LinkError(f"{which}; state another node for guard.lease")
            token = token % most | 1
            lease = NodeWrite(guard.lease, token, "UInt32")
            self._write((lease,), (), epoch, "taking the lease")
            fence = (lease,)
        shown = self._board.get(guard.lease)
        self._earlier = frozenset((0, self._token, None if shown is None else shown.value)) - {token}
        self._token, self._epoch, self._taken_s = token, epoch, time.monotonic()
        return OpcuaWire(self._keeper, self._translation, fence, epoch, lambda: self._holds(token))

    def beat(self) -> None:
        """Say that the guard is alive; LinkError where nobody hears it, LeaseVoid where the lease is over.

        Where nobody has taken a lease, or the mapping has no heartbeat, nothing happens.
        """
        node = self._mapping.guard.heartbeat
        if node is None or not self._token:
            return
        if self._keeper.epoch != self._epoch or not self._holds(self._token):
            why = "" if self.permitted else " because its operators do not permit writing any more"
            self._leave()
            raise LeaseVoid(f"the plant's own control has taken over{why}; take a new lease")
        self._beats = _after(self._beats, self._keeper.largest(node))
        beat = NodeWrite(node, self._beats, "UInt32")
        self._write((beat,), self._fence, self._epoch, "the heartbeat", BEAT_S)

    def give_back(self) -> None:
        """End the lease, and with it the heartbeat; where nobody holds one, nothing happens."""
        lease, token = self._mapping.guard.lease, self._token
        ours = token != 0 and self._keeper.epoch == self._epoch and self._shows(token)
        self._token = 0
        if ours and lease is not None:
            self._write((NodeWrite(lease, 0, "UInt32"),), (), self._epoch, "giving back the lease")

    @property
    def held(self) -> bool | None:
        """Whether the plant shows that its own recipe waits; None where it does not say."""
        shown = self._board.get(self._mapping.guard.hold)
        return None if shown is None or not isinstance(shown.value, int) else bool(shown.value)

    def raise_alarm(self, text: str, seen: bool = False) -> None:
        """Show ``text`` in the control system's own alarm list, empty to take it back; it needs no lease.

        ``seen``: somebody has acknowledged it here already. LinkError where there is no such list, it is not reached,
        or the connection is not encrypted.
        """
        guard = self._mapping.guard
        if guard.alarm is None:
            raise LinkError("the mapping has no node for an alarm; state guard.alarm")
        self._write((NodeWrite(guard.alarm, text, "String"),), (), self._keeper.epoch, "the alarm")
        if seen and guard.acknowledged is not None:
            with contextlib.suppress(LinkError):  # where the plant lets nobody but its own people say so
                said = NodeWrite(guard.acknowledged, True, "Boolean")
                self._write((said,), (), self._keeper.epoch, "its acknowledgement")

    def hold(self, on: bool) -> None:
        """Let the plant's own recipe wait, which moves nothing and needs no lease, or go on, which needs it.

        After a fallback it must wait, or it begins again what the fallback ended. LinkError where the mapping has no
        node for it, it is not reached, or the connection is not encrypted; to go on, also where nothing may be written.
        """
        node = self._mapping.guard.hold
        if node is None:
            raise LinkError("the mapping has no node that lets the plant's recipe wait; state guard.hold")
        fence: tuple[NodeWrite, ...] = ()
        if not on:
            self._refuse_unfit()
            fence = self._fence
            if self._mapping.guard.lease is not None and not fence:
                raise LinkError("only who holds the lease lets the plant's recipe go on; take it first")
        self._write((NodeWrite(node, on, "Boolean"),), fence, self._keeper.epoch, "holding the plant's recipe")

    def close(self) -> None:
        """End the connection; the lease is not given back, and the plant sheds where it hears nothing."""
        self.source.ended = True
        self._keeper.close()

    def __enter__(self) -> Self:
        """The link itself."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Close it."""
        self.close()

    def _leave(self) -> None:
        """Give back a lease that operators do not permit any more; where that fails, it ends by itself."""
        if not self.permitted:
            with contextlib.suppress(LinkError):
                self.give_back()

    @property
    def _fence(self) -> tuple[NodeWrite, ...]:
        lease = self._mapping.guard.lease
        ours = self._token != 0 and self._keeper.epoch == self._epoch and self._shows(self._token)
        return () if lease is None or not ours else (NodeWrite(lease, self._token, "UInt32"),)

    @property
    def permitted(self) -> bool:
        """Whether the plant's operators let us write, where they have a word for it."""
        shown = self._board.get(self._mapping.guard.permit)
        return shown is None or (shown.value is True and shown.status >> 30 != 2)

    def _refuse_unfit(self) -> None:
        """LinkError where nothing may be written now."""
        if self._security.refusal:
            raise LinkError(self._security.refusal)
        if not self._keeper.up:
            raise LinkError(f"the plant is not reached: {self._keeper.trouble}")
        most_s = self._mapping.connection.clock_s
        if abs(self._board.clock_s) > most_s:
            raise LinkError(
                f"the server's clock is {self._board.clock_s:+.1f} s from ours, {most_s:g} s are allowed; set one"
            )
        if not self.permitted:
            self._leave()
            raise LinkError("the plant's operators do not permit writing; they must switch it on at the plant")

    def _holds(self, token: int) -> bool:
        """Whether the lease is ours and may be used: operators who take their permission back end it at once."""
        return self.permitted and self._shows(token)

    def _shows(self, token: int) -> bool:
        """Whether the plant shows our lease, or has not shown whose it is since we took it.

        What was shown before, or is nobody's, and comes soon after may have been on its way already: it counts once the
        plant has shown that the lease is ours.
        """
        if token != self._token:
            return False
        shown = self._board.get(self._mapping.guard.lease)
        if shown is None or shown.value == token:
            self._earlier = self._earlier if shown is None else frozenset()
            return True
        late_s = 2.0 * self._mapping.connection.publish_s + LATE_S if shown.value in self._earlier else 0.0
        return shown.received_s < self._taken_s + late_s

    def _write(
        self,
        writes: tuple[NodeWrite, ...],
        fence: tuple[NodeWrite, ...],
        epoch: int,
        what: str,
        within_s: float | None = None,
    ) -> None:
        """Write in one call and wait for the answer; LinkError that begins with ``what`` where it is not a good one."""
        if not self._security.encrypted:
            raise LinkError(f"{what}: {self._security.refusal}")

        async def work(session: Session) -> str:
            return await carry_out(session, WriteOrder(writes, (), ()), fence)

        answer(self._keeper.begin(work, epoch), within_s or self._mapping.connection.answer_s, what)


def _after(beats: int, most: int) -> int:
    """The heartbeat after ``beats``, in a node that counts up to ``most``."""
    return 0 if beats >= most else beats + 1
