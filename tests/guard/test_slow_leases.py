"""Links that need long to give a lease: one attempt at a time, awaited, and what comes late is used or given back."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.trips import FallbackStands
from homeostat.domain.events.writes import LeaseTried
from homeostat.domain.mode import Mode, Verb
from homeostat.guard.settings import GuardSettings
from homeostat.guard.writing import bounded
from homeostat.guard.writing.lane import NoAnswer
from tests.guard.test_blocking_links import Blocked, timed, until
from tests.guard.test_memory import FALLBACK, remembered
from tests.guard.test_people import tell
from tests.guard.vessel import DRAIN, Vessel, World, running

SLOW = GuardSettings(sync_s=5.0, call_s=0.05, lease_s=0.1, again_s=10.0, lease_within_s=5.0)


def arrived(world: World) -> bool:
    """Whether what the link says to who asked for the lease has come."""
    return bool(world.guard._parts.tenure._lease.arrived)  # type: ignore[union-attr]


class Slow(Blocked):
    """A vessel whose lease is over when it says so, and comes when it is let go; counts what overlaps."""

    def __init__(self, *calls: str) -> None:
        super().__init__(*calls)
        self.inside, self.overlaps, self._lock = 0, 0, threading.Lock()

    over = False

    @property
    def void(self) -> bool:
        return self.over

    def _count(self, by: int) -> None:
        with self._lock:
            self.inside += by
            self.overlaps += self.inside > 1

    def take(self) -> Vessel:
        self._count(1)
        try:
            found = super().take()
            self.over = False
            return found
        finally:
            self._count(-1)

    def give_back(self) -> None:
        self._count(1)
        try:
            super().give_back()
        finally:
            self._count(-1)

    def release(self) -> None:
        """Everything that hangs comes back."""
        self.blocked = set()
        self.let_go.set()


def losing(settings: GuardSettings = SLOW) -> tuple[World, Slow]:
    """A vessel that runs, has taken the lease away, and gives none before it is let go."""
    vessel = Slow()
    world = running(vessel=vessel, settings=settings)
    world.tick(10)
    vessel.called.clear()
    vessel.blocked = {"take"}
    vessel.over = True
    return world, vessel


def bounded_lease(vessel: Slow, **changed: float) -> bounded.BoundedLease:
    return bounded.BoundedLease(vessel, replace(SLOW, **changed))


def test_a_lost_lease_that_needs_long_is_asked_for_once_and_used_as_soon_as_it_comes() -> None:
    world, vessel = losing()
    timed(world, 100)
    assert vessel.called.count("take") == 1 and "heartbeat" in world.alarms
    vessel.release()
    until(lambda: arrived(world))
    timed(world, 2)
    assert [e.given for e in world.journal.of(LeaseTried)] == [False, True]
    assert vessel.called.count("take") == 1 and "heartbeat" not in world.alarms and vessel.given_back == 0


def test_a_lease_that_is_refused_late_is_asked_for_again() -> None:
    world, vessel = losing()
    vessel.take = lambda: vessel._wait("take") or 1 / 0  # type: ignore[assignment,method-assign,return-value,func-returns-value]
    timed(world, 20)
    vessel.let_go.set()
    vessel.blocked = set()
    until(lambda: arrived(world))
    timed(world, 3)
    tried = world.journal.of(LeaseTried)
    assert [e.given for e in tried[:2]] == [False, False] and "division" in tried[1].reason
    assert vessel.called.count("take") >= 2


def test_a_fallback_acts_at_the_tick_at_which_a_lease_that_needed_long_has_come() -> None:
    world, vessel = losing()
    timed(world, 40, L=14.0)
    assert "shed" in world.alarms and vessel.wire == [] and vessel.called.count("take") == 1
    vessel.release()
    until(lambda: arrived(world))
    timed(world, 1)
    assert [c for _, c in vessel.wire] == [DRAIN.actions.commands]
    timed(world, 3)
    assert world.journal.of(FallbackStands) and vessel.given_back == 0


def test_a_guard_whose_first_lease_needs_long_stands_in_observe_until_it_has_come() -> None:
    vessel = Slow("take")
    world = World(vessel=vessel, settings=SLOW)
    timed(world, 30)
    assert world.guard.mode is Mode.OBSERVE and world.alarms == {"mode"} and vessel.called.count("take") == 1
    vessel.release()
    until(lambda: arrived(world))
    timed(world, 2)
    assert world.guard.mode is Mode.CLOSED_LOOP and world.alarms == set()
    assert [e.mode for e in world.journal.of(ModeEntered)] == ["observe", "closed-loop"]


def test_who_orders_another_mode_meanwhile_has_it() -> None:
    vessel = Slow("take")
    world = World(vessel=vessel, settings=SLOW)
    timed(world, 3)
    heard = tell(world, Verb.MODE, "closed-loop")
    assert not heard.done and "has not answered for" in heard.reason and heard.reason.endswith("; it may take 5 s")
    assert tell(world, Verb.MODE, "advise").done
    vessel.release()
    until(lambda: arrived(world))
    timed(world, 5)
    assert world.guard.mode is Mode.ADVISE
    assert tell(world, Verb.MODE, "closed-loop").done and vessel.called.count("take") == 1, "it is kept so long"


def test_a_lease_that_needs_longer_than_it_may_is_an_alarm_until_it_has_come() -> None:
    world, vessel = losing(replace(SLOW, lease_within_s=1.0))
    timed(world, 3)
    until(lambda: world.tick() is not None and "lease:late" in world.alarms)
    cause = next(a.cause for a in world.guard.alarms if a.id == "lease:late")
    assert "the link has not given a lease for" in cause and cause.endswith("1 s are allowed")
    vessel.release()
    until(lambda: arrived(world))
    timed(world, 3)
    assert "lease:late" not in world.alarms and "heartbeat" not in world.alarms


def test_the_next_attempt_waits_until_what_nobody_claimed_was_given_back() -> None:
    vessel = Slow("take", "give_back")
    lease = bounded_lease(vessel, lease_within_s=1.0)
    with pytest.raises(NoAnswer, match="taking the lease"):
        lease.take()
    vessel.blocked = {"give_back"}
    vessel.let_go.set()
    until(lambda: vessel.leases == 1)
    vessel.let_go.clear()
    until(lambda: "give_back" in vessel.called)
    for _ in range(5):
        with pytest.raises(NoAnswer, match="is being given back"):
            lease.take()
    assert vessel.called.count("take") == 1 and lease.awaited and not lease.arrived
    vessel.release()
    until(lambda: not lease.awaited)
    wire = lease.take()
    assert wire.send(DRAIN.actions.commands).done and (vessel.leases, vessel.given_back) == (2, 1)
    assert vessel.overlaps == 0


def test_a_lease_is_never_given_back_behind_the_back_of_who_has_claimed_it() -> None:
    for _ in range(20):
        vessel = Slow("take")
        lease = bounded_lease(vessel, lease_s=0.001, lease_within_s=0.02)
        with pytest.raises(NoAnswer):
            lease.take()
        vessel.release()
        time.sleep(0.02)
        found: list[Any] = []
        while not found:
            try:
                found.append(lease.take())
            except NoAnswer:
                time.sleep(0.001)
        time.sleep(0.05)
        assert vessel.leases - vessel.given_back == 1 and vessel.overlaps == 0


@pytest.mark.parametrize("error", [ConnectionError("reset by peer"), SystemExit(1)])
def test_a_lease_that_cannot_be_given_back_keeps_nobody_from_asking_again(error: BaseException) -> None:
    class Breaks(Slow):
        def give_back(self) -> None:
            super().give_back()
            raise error

    vessel = Breaks("take")
    lease = bounded_lease(vessel, lease_within_s=0.05)
    with pytest.raises(NoAnswer):
        lease.take()
    vessel.release()
    until(lambda: not lease.awaited)
    assert lease.take().send(DRAIN.actions.commands).done and (vessel.leases, vessel.given_back) == (2, 1)


def test_a_lost_lease_that_has_come_is_taken_again_and_one_that_is_held_is_not_waited_for() -> None:
    vessel = Slow("take")
    vessel.let_go.set()
    world = running(vessel=vessel, settings=SLOW)
    tenure = world.guard._parts.tenure
    assert tenure.held
    vessel.let_go.clear()
    assert "has not answered" in tenure.take(world.vessel.now_s)
    vessel.let_go.set()
    until(lambda: tenure._lease.arrived)  # type: ignore[union-attr]
    assert tenure.held and not tenure.arrived, "nobody waits for it"
    assert tenure.take(world.vessel.now_s) == ""
    vessel.let_go.clear()
    vessel.over = True
    world.tick()
    vessel.let_go.set()
    until(lambda: tenure.arrived)
    assert not tenure.held and tenure.retake(world.vessel.now_s)


def test_a_guard_whose_first_lease_was_refused_stands_in_observe_though_its_fallback_gets_one_later() -> None:
    class Refusing(Slow):
        refused = 0

        def take(self) -> Vessel:
            if not self.refused:
                self.refused += 1
                raise PermissionError("somebody else has it")
            return super().take()

    vessel = Refusing("take")
    memory = remembered(ModeEntered("closed-loop", ""), FALLBACK)
    world = World(vessel=vessel, settings=SLOW, memory=memory, goes_on=True)
    timed(world, 2)
    assert world.guard.mode is Mode.OBSERVE and vessel.called == ["take"] and vessel.wire == []
    vessel.release()
    until(lambda: arrived(world))
    timed(world, 2)
    assert vessel.wire and world.guard._latch.reason and world.guard.mode is Mode.OBSERVE
