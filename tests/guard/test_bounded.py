"""A lease that may block, by itself: what waits, what piles up, and what is given back."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from homeostat.domain.recovery import Command
from homeostat.guard.settings import GuardSettings
from homeostat.guard.writing.bounded import MOST, BoundedLease
from homeostat.guard.writing.lane import NoAnswer
from tests.guard.test_blocking_links import FALLBACK, QUICK, Blocked
from tests.guard.vessel import Answer, Vessel

PATIENT = GuardSettings(call_s=5.0, lease_s=5.0)
"""Whoever waits so long waits for the call and not for the time."""


def threads(name: str) -> list[threading.Thread]:
    return [t for t in threading.enumerate() if t.name == name]


@pytest.fixture
def vessel() -> Iterator[Blocked]:
    found = Blocked()
    yield found
    found.let_go.set()


def test_a_lease_is_given_back_by_a_call_of_its_own(vessel: Blocked) -> None:
    lease = BoundedLease(vessel, PATIENT)
    lease.give_back()
    assert vessel.called == ["give_back"] and vessel.given_back == 1
    vessel.blocked = {"give_back"}
    with pytest.raises(NoAnswer, match="giving back the lease has not answered"):
        BoundedLease(vessel, QUICK).give_back()


def test_nobody_takes_another_lease_to_get_round_eight_writes_that_hang(vessel: Blocked) -> None:
    lease = BoundedLease(vessel, QUICK)
    vessel.blocked = {"send"}
    for _ in range(MOST):
        assert not lease.take().send(FALLBACK).done
    with pytest.raises(NoAnswer, match="8 writes hang in the link"):
        lease.take()
    assert vessel.called.count("take") == MOST
    vessel.let_go.set()
    deadline = time.monotonic() + 60.0
    while lease._lanes and time.monotonic() < deadline:
        time.sleep(0.01)
        lease._lanes = [lane for lane in lease._lanes if lane.busy]
    lease.take()
    assert vessel.called.count("take") == MOST + 1


def test_a_link_that_takes_its_time_is_waited_for() -> None:
    class Slow(Vessel):
        def take(self) -> Vessel:
            time.sleep(0.05)
            return super().take()

    assert BoundedLease(Slow(), PATIENT).take().send(FALLBACK).done


def test_one_lane_is_enough_for_questions_that_are_answered() -> None:
    class Telling(Vessel):
        void = False

    before = set(threads("whether the lease lasts"))
    lease = BoundedLease(Telling(), PATIENT)
    assert not any(lease.take().void for _ in range(4))
    assert len(set(threads("whether the lease lasts")) - before) == 1


def test_no_process_waits_for_a_lease(vessel: Blocked) -> None:
    vessel.blocked = {"take"}
    with pytest.raises(NoAnswer):
        BoundedLease(vessel, QUICK).take()
    assert all(t.daemon for t in threads("taking the lease"))


def eventually(true: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + 60.0
    while not true() and time.monotonic() < deadline:
        time.sleep(0.005)
    return true()


def test_a_lease_that_has_come_late_is_overdue_no_more(vessel: Blocked) -> None:
    vessel.blocked = {"take"}
    lease = BoundedLease(vessel, GuardSettings(call_s=0.05, lease_s=0.05, lease_within_s=0.1))
    with pytest.raises(NoAnswer):
        lease.take()
    assert eventually(lambda: lease.overdue != "") and "0.1 s are allowed" in lease.overdue
    vessel.let_go.set()
    assert eventually(lambda: lease.overdue == "")


@pytest.mark.parametrize("refused", [True, False])
def test_only_what_the_link_gave_is_given_back_to_it(refused: bool) -> None:
    class Refusing(Blocked):
        def take(self) -> Vessel:
            self._wait("take")
            if refused:
                raise PermissionError("somebody else has it")
            return self

    vessel = Refusing("take")
    lease = BoundedLease(vessel, GuardSettings(call_s=0.05, lease_s=0.05, lease_within_s=0.1))
    with pytest.raises(NoAnswer):
        lease.take()
    vessel.let_go.set()
    assert eventually(lambda: not lease.awaited)
    assert vessel.given_back == (0 if refused else 1)


def test_the_way_of_a_fallback_is_its_own_urgent_way() -> None:
    wire = BoundedLease(Vessel(), PATIENT).take()
    assert wire.urgent is not wire and wire.urgent.urgent is wire.urgent


class Asked(Answer):
    """A ticket that counts how often it is asked."""

    times = 0
    ready = True

    @property
    def done(self) -> bool:  # type: ignore[override]
        type(self).times += 1
        return self.ready

    @done.setter
    def done(self, value: bool) -> None: ...


def test_a_ticket_that_is_done_is_asked_no_more() -> None:
    class Link(Vessel):
        def send(self, commands: tuple[Command, ...]) -> Answer:
            return Asked()

    Asked.times = 0
    ticket = BoundedLease(Link(), PATIENT).take().send(FALLBACK)
    assert all(ticket.done for _ in range(3)) and Asked.times == 1


def test_a_ticket_is_not_asked_while_another_write_hangs_on_its_way() -> None:
    class Link(Blocked):
        def send(self, commands: tuple[Command, ...]) -> Any:
            self._wait("send")
            return Answer(done=False)

    vessel = Link()
    wire = BoundedLease(vessel, QUICK).take()
    first = wire.send(FALLBACK)
    vessel.blocked = {"send"}
    assert not wire.send(FALLBACK).done
    assert not first.done and first.error == ""
    vessel.let_go.set()


@pytest.mark.parametrize(("answer", "error"), [
    (Answer(done=True, error="half of it was refused"), "half of it was refused"), (Answer(done=True), ""),
    (Answer(done=False, error="not yet"), ""),
])  # fmt: skip
def test_what_went_wrong_is_said_once_the_link_has_answered(answer: Answer, error: str) -> None:
    class Link(Vessel):
        def send(self, commands: tuple[Command, ...]) -> Answer:
            return answer

    ticket = BoundedLease(Link(), PATIENT).take().send(FALLBACK)
    assert ticket.done is answer.done and ticket.error == error


def test_a_ticket_that_breaks_when_it_is_asked_again_is_done_and_says_why() -> None:
    class Breaks(Answer):
        asked = 0

        @property
        def done(self) -> bool:  # type: ignore[override]
            type(self).asked += 1
            if self.asked > 1:
                raise ConnectionError("reset by peer")
            return False

        @done.setter
        def done(self, value: bool) -> None: ...

    class Link(Vessel):
        def send(self, commands: tuple[Command, ...]) -> Answer:
            return Breaks()

    ticket = BoundedLease(Link(), PATIENT).take().send(FALLBACK)
    assert ticket.done and "reset by peer" in ticket.error
