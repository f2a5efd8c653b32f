"""What writing needs was lost: the guard goes down to observe by itself, and a person alone raises it again."""

from __future__ import annotations

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.events.people import AlarmRaised, ModeEntered
from homeostat.domain.events.trips import FallbackActivated, Latched
from homeostat.domain.events.writes import LeaseLost, WriteIntended
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.observation import StandBack, Trouble
from homeostat.guard.mailbox import MOST, Mailbox
from tests.guard.test_lapse import lapsing
from tests.guard.test_people import latched, tell
from tests.guard.vessel import World, running


def test_a_guard_that_stands_back_observes_and_writes_nothing_until_a_person_says_so() -> None:
    world = running()
    world.guard.mailbox.put(StandBack("the connection was lost"))
    world.tick(2)
    assert world.guard.mode is Mode.OBSERVE
    entered = world.journal.of(ModeEntered)[-1]
    assert (entered.mode, entered.person, entered.reason) == ("observe", "", "the connection was lost")
    assert [a.cause for a in world.journal.of(AlarmRaised) if a.alarm == "mode:observe"] == [
        "observe only: the connection was lost"
    ]
    world.vessel.wire.clear()
    world.vessel.values["T"] = 400.0
    world.tick(30)
    assert world.vessel.wire == [] and not world.journal.of(Latched), "a trip is an alarm where nobody writes"
    world.vessel.values["T"] = 310.0
    world.tick(30)
    assert tell(world, Verb.MODE, "closed-loop").done and world.journal.of(ModeEntered)[-1].mode == "closed-loop"


def test_a_guard_that_observes_already_says_nothing() -> None:
    world = running()
    tell(world, Verb.MODE, "observe")
    before = len(world.journal.of(ModeEntered))
    for _ in range(3):
        world.guard.mailbox.put(StandBack("the connection was lost"))
        world.tick(1)
    assert len(world.journal.of(ModeEntered)) == before
    assert not [a for a in world.journal.of(AlarmRaised) if a.alarm == "mode:observe"]


def test_a_latch_stands_whoever_stands_back() -> None:
    world: World = latched()
    why = world.guard.latched
    world.guard.mailbox.put(StandBack("the clocks differ"))
    world.tick(2)
    assert world.guard.mode is Mode.OBSERVE and world.guard.latched == why
    heard = tell(world, Verb.MODE, "closed-loop")
    assert not heard.done and "latched" in heard.reason


@pytest.mark.parametrize("reason", ["", "x" * 10_000])
def test_any_reason_is_taken(reason: str) -> None:
    world = running()
    world.guard.mailbox.put(StandBack(reason))
    world.tick(1)
    assert world.guard.mode is Mode.OBSERVE and len(world.journal.of(ModeEntered)[-1].reason) < 1000


@pytest.mark.parametrize("tells", [True, False])
def test_nothing_is_taken_or_written_in_the_tick_of_a_new_connection(tells: bool) -> None:
    world, vessel = lapsing(tells)
    world.ask(name="r2")
    world.tick()  # its write is on the wire when the connection is lost and made again between two ticks
    intended = len(world.journal.of(WriteIntended))
    assert world.sent
    vessel.wire.clear()
    vessel.shed()
    leases, heard = vessel.leases, len(vessel.beats)
    world.guard.mailbox.put(StandBack("the connection was lost and made again"))
    world.tick(1, L=14.0)
    assert world.guard.mode is Mode.OBSERVE
    assert (vessel.leases, vessel.wire, len(vessel.beats)) == (leases, [], heard)
    world.tick(30)
    assert (vessel.leases, vessel.wire) == (leases, [])
    assert not world.journal.of(Latched) and not world.journal.of(FallbackActivated)
    assert len(world.journal.of(WriteIntended)) == intended and len(world.journal.of(LeaseLost)) <= 1


def test_a_limit_that_trips_in_the_tick_of_a_new_connection_calls_a_person() -> None:
    told, other = running(), running()
    while not other.journal.of(Latched):
        other.tick(1, L=12.6)
        if not other.journal.of(Latched):
            told.tick(1, L=12.6)
    told.guard.mailbox.put(StandBack("the connection was lost and made again"))
    told.tick(20, L=12.6)
    assert other.sent and told.sent == [] and not told.journal.of(Latched)
    assert [a for a in told.guard.alarms if a.priority is Priority.CRITICAL], "somebody must act"


def test_a_mailbox_that_others_have_filled_takes_a_loss_all_the_same() -> None:
    world = running()
    while world.guard.mailbox.put(Trouble("recovery", "too much is said")):
        pass
    assert world.guard.mailbox.put(StandBack("the connection was lost"))
    world.tick()
    assert world.guard.mode is Mode.OBSERVE
    assert world.journal.of(ModeEntered)[-1].reason == "the connection was lost"


def test_a_loss_waits_apart_from_what_else_is_said_and_counts_once() -> None:
    mailbox = Mailbox()
    assert mailbox.stand_back() is None
    for _ in range(2 * MOST):
        assert mailbox.put(StandBack("first"))
    assert mailbox.put(StandBack("last")) and mailbox.take() == ()
    assert mailbox.stand_back() == StandBack("last") and mailbox.stand_back() is None
