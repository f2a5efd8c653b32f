"""Links that block: whatever a link does, a tick returns, and the fallback leaves."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.trips import FallbackStands, Tripped
from homeostat.domain.events.writes import WriteEnded, WriteIntended, WriteResult
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.recovery import Command
from homeostat.guard.settings import GuardSettings
from homeostat.guard.writing import bounded
from homeostat.guard.writing.lane import Lane, NoAnswer
from homeostat.links.simulated import SimulatedLink
from tests.equipment.links.misbehaving.link import Blocking, Misbehaving
from tests.equipment.links.scripted import ScriptedPlant
from tests.equipment.waiting import waits
from tests.guard.test_on_links import SCRIPT
from tests.guard.vessel import DRAIN, Answer, Vessel, World, running

TICK_S = 1.5
"""Longest that a tick in which something begins to hang is ready to wait; bounded calls add up to less [s]."""
QUICK = GuardSettings(sync_s=5.0, call_s=0.05, lease_s=0.1)
LONG_S = 60.0
"""Longest wait for a thread of a busy host, wall-clock [s]."""
FALLBACK = DRAIN.actions.commands


def until(holds: Callable[[], bool]) -> None:
    """Wait for what another thread does."""
    deadline = time.monotonic() + LONG_S
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.005)


class Blocked(Vessel):
    """A vessel with calls that come back only when they are let go."""

    never_blocks = False

    def __init__(self, *calls: str, most: int = 1000) -> None:
        super().__init__()
        self.blocked, self._most = set(calls), most
        self.let_go = threading.Event()
        self.called: list[str] = []
        self.hanging: list[str] = []

    def _wait(self, call: str) -> None:
        self.called.append(call)
        if call in self.blocked and self.called.count(call) <= self._most:
            self.hanging.append(call)
            self.let_go.wait()
            self.hanging.remove(call)

    def take(self) -> Vessel:
        self._wait("take")
        return super().take()

    def beat(self) -> None:
        self._wait("beat")
        super().beat()

    def give_back(self) -> None:
        self._wait("give_back")
        super().give_back()

    def send(self, commands: tuple[Command, ...]) -> Answer:
        self._wait("send")
        return super().send(commands)


def timed(world: World, times: int = 1, **values: float) -> None:
    """Ticks of which none waits long."""
    for _ in range(times):
        with waits() as waited:
            world.tick(**values)
        assert waited.vain_s < TICK_S


def world(*calls: str, most: int = 1000, **rest: Any) -> tuple[World, Blocked]:
    """A vessel that runs, and whose calls begin to block now."""
    vessel = Blocked()
    found = running(vessel=vessel, settings=QUICK, **rest)
    found.tick(10)
    vessel.wire.clear()
    vessel.called.clear()
    vessel.blocked, vessel._most = set(calls), most
    return found, vessel


def hanging() -> int:
    return threading.active_count()


@pytest.mark.parametrize("call", ["take", "beat", "give_back", "send"])
def test_a_tick_returns_whatever_call_of_the_link_hangs(call: str) -> None:
    subject, vessel = world(call)
    before = hanging()
    subject.ask()
    timed(subject, 3)
    subject.order(Verb.MODE, Mode.OBSERVE.value)
    timed(subject, 3)
    subject.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    timed(subject, 40)
    with waits() as waited:
        subject.guard.stop("enough")
    assert waited.vain_s < TICK_S
    assert call in vessel.called and hanging() - before <= 6
    vessel.let_go.set()


def test_the_fallback_leaves_at_the_tick_of_the_trip_while_an_earlier_write_hangs() -> None:
    subject, vessel = world("send", most=1)
    subject.ask()
    timed(subject, 2)
    assert vessel.wire == [] and subject.guard.latched is None
    timed(subject, 4, L=14.0)
    tripped = [at_s for e, at_s in subject.journal.events if isinstance(e, Tripped)]
    assert [(at_s, c) for at_s, c in vessel.wire] == [(tripped[0], FALLBACK)]
    assert len(subject.journal.of(FallbackStands)) == 1 and vessel.leases == 1


def test_what_hung_and_arrives_after_the_fallback_is_put_right() -> None:
    subject, vessel = world("send", most=1)
    subject.ask()
    timed(subject, 2)
    timed(subject, 4, L=14.0)
    vessel.let_go.set()
    until(lambda: len(vessel.wire) == 2)
    assert vessel.accepted["F.sp"] == 0.02, "the request's write has come through behind the fallback"
    timed(subject, 4)
    assert vessel.accepted["F.sp"] == 0.0 and "late:F.sp" in {a.id for a in subject.guard.alarms}


def test_where_the_fallback_hangs_as_well_it_goes_a_fresh_way_with_a_new_lease() -> None:
    subject, vessel = world("send", most=2)
    subject.ask()
    timed(subject, 2)
    timed(subject, 8, L=14.0)
    attempts = [e for e in subject.journal.of(WriteIntended) if e.source == "drain"]
    ends = [e.result for e in subject.journal.of(WriteEnded) if e.write == attempts[0].write]
    assert ends[:2] == [WriteResult.TIMED_OUT, WriteResult.ACCEPTED] and vessel.leases == 2
    assert [c for _, c in vessel.wire] == [FALLBACK] and len(subject.journal.of(FallbackStands)) == 1


def test_a_link_in_which_everything_hangs_is_tried_for_ever_with_few_threads_and_obeys_once_it_comes_back() -> None:
    subject, vessel = world("send", "take", "beat", "give_back")
    before = hanging()
    timed(subject, 200, L=14.0)
    assert hanging() - before <= bounded.MOST + 6
    assert {"lease", "shed", "fallback:drain", "fallback:close"} <= subject.alarms
    assert vessel.wire == [] and not subject.guard._latch.standing
    vessel.let_go.set()
    until(lambda: not vessel.hanging)
    timed(subject, 40)
    assert vessel.accepted["X.cmd"] == 0.0 and subject.guard._latch.standing


def test_a_heartbeat_that_hangs_is_an_alarm_until_one_is_taken() -> None:
    subject, vessel = world("beat", most=1)
    timed(subject, 2)
    assert vessel.beats[-1] < vessel.now_s - 1.0 and "heartbeat" in subject.alarms
    vessel.let_go.set()
    until(lambda: not subject.guard._parts.tenure._lease._heartbeat.busy)  # type: ignore[union-attr]
    timed(subject, 2)
    assert vessel.beats[-1] == vessel.now_s and "heartbeat" not in subject.alarms


@pytest.mark.parametrize(("kept_s", "came"), [(LONG_S, False), (LONG_S, True), (0.05, True)])
def test_a_lease_that_comes_late_is_claimed_by_the_next_order_or_given_back(kept_s: float, came: bool) -> None:
    settings = GuardSettings(sync_s=5.0, call_s=0.05, lease_s=0.1, lease_within_s=kept_s)
    vessel = Blocked("take", most=1)
    lease = bounded.BoundedLease(vessel, settings)
    with pytest.raises(NoAnswer, match="taking the lease has not answered"):
        lease.take()
    with pytest.raises(NoAnswer):
        lease.take()
    assert vessel.called == ["take"], "one call at a time"
    vessel.let_go.set()
    if came:
        until(lambda: lease.arrived if kept_s == LONG_S else not lease.awaited)
        assert vessel.given_back == (0 if kept_s == LONG_S else 1)
    deadline = time.monotonic() + LONG_S
    while True:
        try:
            wire = lease.take()
            break
        except NoAnswer:
            assert time.monotonic() < deadline
    ticket = wire.send(FALLBACK)
    until(lambda: ticket.done)
    assert vessel.leases == (1 if kept_s == LONG_S else 2)


def test_a_ticket_that_hangs_is_not_done_and_one_that_breaks_is_an_error() -> None:
    class Odd(Answer):
        @property
        def done(self) -> bool:  # type: ignore[override]
            return ask()

        @done.setter
        def done(self, value: bool) -> None: ...

    class Link(Vessel):
        def send(self, commands: tuple[Command, ...]) -> Answer:
            return Odd()

    let_go = threading.Event()

    def hangs() -> bool:
        return let_go.wait(30.0)

    def breaks() -> bool:
        raise ConnectionError("reset by peer")

    ask: Callable[[], bool] = hangs
    ticket = bounded.BoundedLease(Link(), QUICK).take().send(FALLBACK)
    assert not ticket.done and not ticket.done and ticket.error == ""
    let_go.set()
    until(lambda: ticket.done)
    assert ticket.error == ""
    answers = iter([False, False])

    def slowly() -> bool:
        return next(answers, True)

    ask, patient = slowly, replace(QUICK, call_s=LONG_S, lease_s=LONG_S)
    ticket = bounded.BoundedLease(Link(), patient).take().send(FALLBACK)
    assert not ticket.done and ticket.done
    ask = breaks
    with pytest.raises(ConnectionError, match="reset by peer"):
        bounded.BoundedLease(Link(), patient).take().send(FALLBACK)


def test_a_lane_makes_one_call_at_a_time_and_hands_on_what_it_raises() -> None:
    lane, let_go = Lane("a question", LONG_S), threading.Event()
    assert lane.ask(lambda: 3) == 3 and not lane.busy
    with pytest.raises(ConnectionError, match=r"^KeyboardInterrupt$"):
        lane.ask(_interrupt)
    lane._wait_s = 0.05
    with pytest.raises(NoAnswer, match=r"a question has not answered for \d+\.\d s"):
        lane.ask(lambda: let_go.wait(LONG_S))
    asked: list[int] = []
    with pytest.raises(NoAnswer):
        lane.ask(lambda: asked.append(1))
    assert lane.busy and asked == []
    let_go.set()
    until(lambda: not lane.busy)
    lane._wait_s = LONG_S
    assert lane.ask(lambda: 4) == 4 and asked == [], "what was refused is not made up for"


def test_a_lane_keeps_its_thread_for_the_next_call_and_no_process_waits_for_it() -> None:
    lane = Lane("a question", LONG_S)
    thread = lane.ask(threading.current_thread)
    time.sleep(0.05)
    assert lane.ask(threading.current_thread) is thread and thread.daemon and thread.name == "a question"


def test_whoever_waits_for_a_lane_waits_for_the_call_that_is_under_way_and_no_longer_than_may_be() -> None:
    lane, let_go = Lane("a question", 0.2), threading.Event()
    lane.wait()
    with pytest.raises(NoAnswer):
        lane.ask(lambda: let_go.wait(LONG_S))
    with waits() as waited:
        lane.wait()
    assert waited.limits_s == [0.2] and waited.vain_s == 0.2 and lane.busy
    lane._wait_s = LONG_S
    let_go.set()
    lane.wait()
    assert not lane.busy


def _interrupt() -> None:
    raise KeyboardInterrupt


def test_a_link_that_never_blocks_is_called_directly_and_no_thread_is_made() -> None:
    subject = SimulatedLink(ScriptedPlant(SCRIPT))
    assert bounded.bounded(subject, QUICK) is subject and bounded.bounded(None, QUICK) is None
    assert bounded.bounded(Misbehaving(subject, ()), QUICK) is not None
    slow = Misbehaving(subject, (Blocking("send", 0.0),))
    found = bounded.bounded(slow, QUICK)
    assert isinstance(found, bounded.BoundedLease) and bounded.bounded(found, QUICK) is found


def test_a_lease_that_does_not_say_that_it_never_blocks_may_block() -> None:
    class Silent:
        def take(self) -> Any: ...
        def beat(self) -> None: ...
        def give_back(self) -> None: ...

    assert isinstance(bounded.bounded(Silent(), QUICK), bounded.BoundedLease)  # type: ignore[arg-type]
