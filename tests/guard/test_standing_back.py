"""What writing needs was lost: the guard goes down to observe by itself, and a person alone raises it again."""

from __future__ import annotations

import pytest

from homeostat.domain.events.people import AlarmRaised, ModeEntered
from homeostat.domain.events.trips import Latched
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.observation import StandBack
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
