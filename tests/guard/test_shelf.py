"""Shelved alarms: for a time, with a reason, never a critical one; what they watch is watched all the same."""

from __future__ import annotations

import math
from typing import Any

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.events.people import AlarmShelved, AlarmUnshelved
from homeostat.domain.events.trips import Tripped
from homeostat.domain.mode import Role, Verb
from homeostat.guard.watch.shelf import LONGEST_S
from tests.guard.test_people import tell
from tests.guard.vessel import World, running


def alarmed(priority: Priority = Priority.HIGH) -> World:
    world = running()
    world.guard._parts.alarms.say("odd", "it is odd", priority, world.vessel.now_s)
    return world


def test_an_alarm_is_shelved_for_its_time_and_shown_again() -> None:
    world = alarmed()
    assert tell(world, Verb.SHELVE, "odd", reason="known", seconds=10.0, role=Role.OPERATOR).done
    shelved = world.journal.of(AlarmShelved)[-1]
    now_s = world.vessel.now_s
    assert (shelved.alarm, shelved.person, shelved.reason, shelved.until_s) == ("odd", "Ada", "known", now_s + 10.0)
    world.tick(9)
    assert world.journal.of(AlarmUnshelved) == []
    world.tick(1)
    assert world.journal.of(AlarmUnshelved) == [AlarmUnshelved("odd", "")]
    world.tick(20)
    assert len(world.journal.of(AlarmUnshelved)) == 1
    assert tell(world, Verb.UNSHELVE, "odd").reason == "alarm 'odd' is not shelved"


def test_whoever_comes_shows_it_again_before() -> None:
    world = alarmed()
    assert tell(world, Verb.SHELVE, "odd", reason="known", seconds=LONGEST_S).done
    assert tell(world, Verb.UNSHELVE, "odd", person="Bo").done
    assert world.journal.of(AlarmUnshelved) == [AlarmUnshelved("odd", "Bo")]
    world.tick(5)
    assert len(world.journal.of(AlarmUnshelved)) == 1


@pytest.mark.parametrize("seconds", [0.0, -1.0, LONGEST_S + 0.001, math.inf, math.nan, True, "60", None])
def test_it_is_shelved_for_a_time_that_a_shift_sees_the_end_of(seconds: Any) -> None:
    world = alarmed()
    heard = tell(world, Verb.SHELVE, "odd", reason="known", seconds=seconds)
    assert not heard.done and "more than 0 and at most 28800 s" in heard.reason
    assert world.journal.of(AlarmShelved) == []


def test_what_is_not_shelved() -> None:
    world = alarmed(Priority.CRITICAL)
    assert (
        tell(world, Verb.SHELVE, "odd", reason="known", seconds=60.0).reason
        == "alarm 'odd' is critical; it is not shelved"
    )
    assert tell(world, Verb.SHELVE, "none", reason="known", seconds=60.0).reason == "there is no alarm 'none'"
    assert tell(world, Verb.SHELVE, "odd", seconds=60.0).reason == "'shelve' needs a reason"
    assert world.journal.of(AlarmShelved) == []


def test_a_limit_whose_alarm_is_shelved_trips_all_the_same() -> None:
    world = alarmed()
    assert tell(world, Verb.SHELVE, "odd", reason="known", seconds=600.0).done
    world.tick(6, L=14.0)
    assert world.guard.latched is not None and world.journal.of(Tripped)
