"""The lease and the heartbeat: a link that breaks over them is an alarm that says so, and returns."""

from __future__ import annotations

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.mode import Mode, Verb
from tests.guard.vessel import Vessel, World, running


class Breaks(Vessel):
    """A vessel whose link breaks over whatever is named."""

    def __init__(self) -> None:
        super().__init__()
        self.broken: dict[str, Exception] = {}

    def _perhaps(self, what: str) -> None:
        if what in self.broken:
            raise self.broken[what]

    def take(self) -> Vessel:
        self._perhaps("take")
        return super().take()

    def beat(self) -> None:
        self._perhaps("beat")
        super().beat()

    def give_back(self) -> None:
        super().give_back()
        self._perhaps("give back")


def cause(world: World, name: str) -> str:
    return next(a.cause for a in world.guard.alarms if a.id == name)


def mode(world: World, mode: Mode) -> None:
    world.order(Verb.MODE, mode.value, reason="a test")
    world.tick()


ERRORS = [(PermissionError("somebody else has it"), "somebody else has it"), (TimeoutError(), "TimeoutError")]


@pytest.mark.parametrize(("error", "why"), ERRORS)
def test_a_lease_that_is_not_given_leaves_the_guard_in_observe(error: Exception, why: str) -> None:
    vessel = Breaks()
    vessel.broken["take"] = error
    world = World(vessel=vessel)
    world.tick()
    assert world.guard.mode is Mode.OBSERVE and cause(world, "mode") == f"the plant gives no lease: {why}"
    assert vessel.beats == [] and vessel.given_back == 0


@pytest.mark.parametrize(("error", "why"), ERRORS)
def test_a_lease_that_cannot_be_given_back_is_not_used_any_more_and_an_alarm(error: Exception, why: str) -> None:
    vessel = Breaks()
    world = running(vessel=vessel)
    vessel.broken["give back"] = error
    mode(world, Mode.OBSERVE)
    alarm = next(a for a in world.guard.alarms if a.id == "lease")
    assert alarm.cause == f"the lease cannot be given back: {why}" and alarm.priority is Priority.HIGH
    assert alarm.raised_s == 5.0 and alarm.returned_s is None
    world.tick(3)
    assert vessel.given_back == 1 and vessel.beats == [1.0, 2.0, 3.0, 4.0]
    vessel.broken.clear()
    mode(world, Mode.CLOSED_LOOP)
    mode(world, Mode.OBSERVE)
    assert vessel.given_back == 2
    returned = next(a for a in world.guard.alarms if a.id == "lease")
    assert returned.returned_s == world.vessel.now_s


@pytest.mark.parametrize(("error", "why"), ERRORS)
def test_a_heartbeat_that_is_not_taken_is_an_alarm_until_nobody_has_to_beat(error: Exception, why: str) -> None:
    vessel = Breaks()
    world = running(vessel=vessel)
    vessel.broken["beat"] = error
    world.tick()
    assert cause(world, "heartbeat") == f"the heartbeat is not taken: {why}" and "heartbeat" in world.alarms
    mode(world, Mode.OBSERVE)
    assert "heartbeat" not in world.alarms
    assert {a.id: a.returned_s for a in world.guard.alarms}["heartbeat"] == world.vessel.now_s


def test_where_nothing_is_leased_nothing_is_given_back() -> None:
    world = World(mode=Mode.OBSERVE)
    world.tick(3)
    assert world.alarms == set()
    world.guard.stop("done")
    assert world.vessel.leases == world.vessel.given_back == 0 and world.vessel.beats == []


def test_a_plant_that_is_only_observed_says_so_to_whoever_wants_to_write() -> None:
    world = World(lease=None)
    world.tick()
    text = "this plant is only observed; attach it with a link that can write"
    assert cause(world, "mode") == text and world.alarms == {"mode"} and world.guard.mode is Mode.OBSERVE


def test_a_person_who_interrupts_the_question_whether_the_lease_lasts_ends_the_guard() -> None:
    class Interrupted(Vessel):
        asked = False

        @property
        def void(self) -> bool:
            if self.asked:
                raise KeyboardInterrupt
            return False

    vessel = Interrupted()
    world = running(vessel=vessel)
    vessel.asked = True
    with pytest.raises(KeyboardInterrupt):
        world.tick()
