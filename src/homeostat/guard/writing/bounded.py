"""A lease that may block, made into one that answers in a bounded time whatever the link does."""

from __future__ import annotations

import contextlib
import threading
from typing import NoReturn, TypeAlias

from homeostat.domain.ports import Lease, Ticket, Wire
from homeostat.domain.recovery import Command
from homeostat.guard.settings import GuardSettings
from homeostat.guard.texts import said
from homeostat.guard.writing.lane import Call, Lane, NoAnswer

MOST = 8
"""Most writes that may hang in a link before nobody takes another lease to get round them; as many questions may."""

TicketState: TypeAlias = tuple[Ticket, bool, str]
"""A link's ticket, whether the link has answered, and what went wrong."""


def bounded(lease: Lease | None, settings: GuardSettings) -> Lease | None:
    """``lease`` as the guard may use it: by itself where it says that it never blocks, else in bounded time."""
    return lease if lease is None or getattr(lease, "never_blocks", False) else BoundedLease(lease, settings)


class BoundedLease:
    """Implements :class:`homeostat.domain.ports.Lease` over one that may block.

    What is late is NoAnswer. A late heartbeat was not sent, as far as anybody knows.
    """

    never_blocks = True
    """Every call returns in bounded time."""

    def __init__(self, lease: Lease, settings: GuardSettings) -> None:
        """``lease`` is called in threads of its own."""
        self._lease, self._settings = lease, settings
        self._heartbeat = Lane("the heartbeat", settings.call_s)
        self._return = Lane("giving back the lease", settings.call_s)
        self._taking: _Taking | None = None
        self._lanes: list[Lane] = []
        self._questions: list[Lane] = []

    @property
    def awaited(self) -> bool:
        """Whether a lease was asked for that nobody has yet: it is under way, has come, or is being given back."""
        return self._taking is not None and not self._taking.over

    @property
    def arrived(self) -> bool:
        """Whether the link has answered somebody who waited for a lease in vain: :meth:`take` says what."""
        return self._taking is not None and self._taking.arrived

    @property
    def overdue(self) -> str:
        """That the link needs longer for a lease than it may; empty where it does not."""
        return "" if self._taking is None else self._taking.overdue

    def take(self) -> BoundedWire:
        """Take the lease, or claim one that was asked for before and came too late; raises as the link does.

        The link is asked for one lease at a time: NoAnswer as long as an earlier one is under way or given back.
        """
        self._lanes = [lane for lane in self._lanes if lane.busy]
        if len(self._lanes) >= MOST:
            raise NoAnswer(f"{len(self._lanes)} writes hang in the link")
        if not self.awaited:
            self._taking = _Taking(self._lease, self._settings.lease_within_s)
            self._taking.call.wait(self._settings.lease_s)
        assert self._taking is not None, "it was asked for"
        if not self._taking.claim():
            self._taking.refuse()
        call, self._taking = self._taking.call, None
        return self._path(call.result())

    def beat(self) -> None:
        """Say that the guard is alive."""
        self._heartbeat.ask(self._lease.beat)

    def give_back(self) -> None:
        """Stop the heartbeat."""
        self._return.ask(self._lease.give_back)

    def _path(self, wire: Wire) -> BoundedWire:
        """A fresh way to the plant: what hangs on an older one does not hold it up."""
        lanes = [Lane(what, self._settings.call_s) for what in ("an earlier write", "an earlier write of a fallback")]
        self._lanes += lanes
        question = self._asking()
        return BoundedWire(wire, lanes[0], question, BoundedWire(wire, lanes[1], question))

    def _asking(self) -> Lane:
        """A lane in which nothing hangs; where it hangs in many, the lease has its heartbeat."""
        free = [lane for lane in self._questions if not lane.busy]
        if not free and len(self._questions) < MOST:
            free = [Lane("whether the lease lasts", self._settings.call_s)]
            self._questions += free
        return (free or self._questions)[0]


class _Taking:
    """A lease that is asked for. One that comes late is kept for a while, and given back where nobody claims it.

    Otherwise the plant would wait for a guard that does not know of its lease.
    """

    def __init__(self, lease: Lease, within_s: float) -> None:
        """``within_s``: longest that the link may need, and longest that its answer is kept, wall-clock [s]."""
        self._lease, self._within_s = lease, within_s
        self._lock, self._claimed, self._ended, self._expired = threading.Lock(), threading.Event(), False, False
        self.call = Call("taking the lease", lease.take)
        threading.Thread(target=self._run, name="taking the lease", daemon=True).start()

    @property
    def over(self) -> bool:
        """Whether nobody has claimed it, and it was given back."""
        return self._ended

    @property
    def arrived(self) -> bool:
        """Whether it can be claimed."""
        return self.call.answered and not self._expired

    @property
    def overdue(self) -> str:
        """That the link needs longer than it may; empty where it does not."""
        if self.call.answered or self.call.age_s <= self._within_s:
            return ""
        return f"the link has not given a lease for {self.call.age_s:.1f} s; {self._within_s:g} s are allowed"

    def claim(self) -> bool:
        """Whether the link has answered, and the answer is the caller's from now on."""
        with self._lock:
            if self.arrived:
                self._claimed.set()
            return self._claimed.is_set()

    def refuse(self) -> NoReturn:
        """Say why it cannot be claimed: NoAnswer."""
        if self._expired:
            raise NoAnswer("a lease that nobody has claimed is being given back")
        raise NoAnswer(f"{self.call.name} has not answered for {self.call.age_s:.1f} s")

    def _run(self) -> None:
        self.call.run()
        self._claimed.wait(self._within_s)
        with self._lock:
            self._expired = not self._claimed.is_set()
        if self._expired:
            with contextlib.suppress(BaseException):  # what the link did not give, it need not take back
                self.call.result()
                self._lease.give_back()
            self._ended = True


class BoundedWire:
    """Implements :class:`homeostat.domain.ports.Wire`: a write that hangs is one that has no answer yet."""

    def __init__(self, wire: Wire, lane: Lane, question: Lane, urgent: BoundedWire | None = None) -> None:
        """``wire`` is called in ``lane``, and asked in ``question`` whether the lease lasts.

        ``urgent``: how a fallback is sent, past what hangs there.
        """
        self._wire, self._lane, self._question, self._over = wire, lane, question, False
        self.urgent: BoundedWire = urgent or self
        """The same wire by another lane."""

    @property
    def void(self) -> bool:
        """Whether the plant says that the lease is over; NoAnswer where it does not say in time."""
        return self._over or self._question.ask(self._asked)

    def _asked(self) -> bool:
        """What the link says; a wire that is void once stays so, and is also where the answer came too late."""
        self._over = bool(self._wire.void)
        return self._over

    def send(self, commands: tuple[Command, ...]) -> BoundedTicket:
        """Begin to write ``commands``; raises what the link raises in time, and NoAnswer while an earlier one hangs."""

        def write() -> TicketState:
            return _state(self._wire.send(commands))

        call = self._lane.begin(write)
        if call.answered:
            call.result()
        return BoundedTicket(self._lane, call)


class BoundedTicket:
    """Implements :class:`homeostat.domain.ports.Ticket`: the link is asked again as long as it has not answered."""

    def __init__(self, lane: Lane, call: Call[TicketState]) -> None:
        """``call``: the write, or the last question after it."""
        self._lane, self._call = lane, call
        self._done, self._error = False, ""

    @property
    def done(self) -> bool:
        """Whether the link has answered."""
        if not self._take() and not self._lane.busy:
            ticket = self._call.result()[0]
            self._call = self._lane.begin(lambda: _state(ticket))
            self._take()
        return self._done

    @property
    def error(self) -> str:
        """What went wrong; empty where nothing did."""
        return self._error

    def _take(self) -> bool:
        """Take note of what the link has said; whether it has answered."""
        if self._call.answered:
            try:
                _, self._done, self._error = self._call.result()
            except Exception as broken:  # a link may break in any way, and late
                self._done, self._error = True, said(broken)
        return self._done


def _state(ticket: Ticket) -> TicketState:
    """What ``ticket`` says now."""
    done = bool(ticket.done)
    return ticket, done, str(ticket.error) if done else ""
