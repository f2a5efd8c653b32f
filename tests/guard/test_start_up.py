"""Start-up: limits of its own, a longest duration, what a kill and a reset make of it, and the start back."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import StartUpBegan, StartUpEnded
from homeostat.domain.events.people import PersonHeard
from homeostat.domain.events.trips import FallbackActivated, Tripped
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.domain.mode import Mode, Verb
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_memory import Line
from tests.guard.vessel import RULES, Journal, World

LONGEST_S = 20.0
SHORT = replace(RULES, start_up=replace(RULES.start_up, longest_s={"waiting": LONGEST_S}))


def filling(**rest: Any) -> World:
    """A vessel whose level does not come so far that it could leave start-up."""
    world = World(rules=SHORT, **rest)
    world.vessel.values["L"] = 3.0
    return world


def hot(world: World) -> None:
    """Up to 330 K, which only start-up allows, no faster than the process can."""
    while world.vessel.values["T"] < 330.0:
        world.tick(1, T=world.vessel.values["T"] + 2.0)


def ended(world: World) -> list[tuple[str, float]]:
    return [(e.reason, at_s) for e, at_s in world.journal.events if isinstance(e, StartUpEnded)]


def test_start_up_that_never_comes_to_its_end_has_ordinary_limits_after_its_longest_duration() -> None:
    world = filling()
    hot(world)
    world.tick(21 - len(world.seen))
    assert world.journal.of(Tripped) == [] and "start-up" not in world.alarms
    assert world.journal.of(StartUpBegan)[0] == StartUpBegan("waiting", 1.0)
    world.tick(1)
    assert ended(world) == [("start-up is not over after 20 s; every limit counts from now on", 22.0)]
    assert "start-up" in world.alarms
    world.tick(1)
    assert [e.limit for e in world.journal.of(Tripped)] == ["LIM-HOT"] and world.journal.of(FallbackActivated)


def test_a_start_up_that_is_left_in_time_raises_nothing_and_its_alarm_returns_with_it() -> None:
    world = filling()
    world.tick(10)
    world.tick(4, L=6.0)
    assert ended(world) == [("it could be left: 'L >= 5' holds (start)", 11.0)]
    world.tick(30)
    assert "start-up" not in world.alarms and len(ended(world)) == 1
    late = filling()
    late.tick(25)
    assert "start-up" in late.alarms and late.seen[-1].state == "waiting"
    late.tick(4, L=6.0)
    assert late.seen[-1].state == "running" and "start-up" not in late.alarms and len(ended(late)) == 1


def test_in_observe_it_is_an_alarm_all_the_same() -> None:
    world = filling(mode=Mode.OBSERVE, lease=None)
    hot(world)
    world.tick(25)
    assert {"start-up", "trip:LIM-HOT"} <= world.alarms and world.sent == []


def killed(world: World, upto: int | None = None) -> World:
    """The guard dies, and another one goes on with what the journal has, cut off after ``upto`` events."""
    journal = Journal(world.journal.events[:upto])
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in journal.events)
    return World(rules=SHORT, vessel=world.vessel, memory=memory, record=journal)


def test_a_kill_makes_start_up_no_longer() -> None:
    world = filling()
    world.tick(15)
    world = killed(world)
    world.tick(6)
    assert "start-up" not in world.alarms
    world.tick(1)
    assert "start-up" in world.alarms and len(world.journal.of(StartUpBegan)) == 1
    world = killed(world)
    hot(world)
    world.tick(4)
    assert world.journal.of(Tripped), "what was over before the kill is over after it"


def test_a_clock_that_was_set_back_while_the_guard_was_dead_makes_start_up_no_longer() -> None:
    world = filling()
    world.tick(15)
    world.vessel.now_s = -50.0
    world = killed(world)
    world.tick(1)
    assert "start-up" in world.alarms


def back_to_a_start(**rest: Any) -> World:
    """Through start-up, a fallback and a reset, up to a start by a person."""
    world = filling(**rest)
    world.tick(5)
    world.tick(5, L=8.0)
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(3)
    world.order(Verb.RESET, reason="no fire")
    world.tick(1)
    world.order(Verb.MODE, "closed-loop")
    world.tick(1, L=3.0)
    return world


def test_only_a_start_begins_another_start_up() -> None:
    world = back_to_a_start()
    world.order(Verb.START, "restart")
    world.tick(2)
    assert world.seen[-1].state == "waiting"
    began = world.journal.of(StartUpBegan)
    assert [b.state for b in began] == ["waiting", "waiting"] and began[1].since_s > 15.0
    hot(world)
    world.tick(int(began[1].since_s + LONGEST_S - world.vessel.now_s))
    assert world.journal.of(Tripped) == []
    world.tick(2)
    assert [e.limit for e in world.journal.of(Tripped)] == ["LIM-HOT"]


def test_a_reset_that_finds_the_plant_in_a_state_of_start_up_gives_no_wider_limits() -> None:
    world = filling()
    world.tick(5)
    world.tick(5, L=8.0)
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(3)
    world.vessel.accepted.update({"T.sp": 310.0, "F.sp": 0.0, "X.cmd": 1.0, "V.man": None})  # by hand
    world.tick(1, L=3.0)
    for tag in ("X.cmd", "V.man"):
        world.order(Verb.IN_SERVICE, tag)
    world.tick(1)
    world.order(Verb.RESET, reason="no fire")
    world.tick(1)
    assert world.seen[-1].state == "waiting" and len(world.journal.of(StartUpBegan)) == 1
    hot(world)
    world.tick(4)
    assert "trip:LIM-HOT" in world.alarms
    world = killed(world)
    world.tick(8)
    assert "trip:LIM-HOT" in world.alarms and len(world.journal.of(StartUpBegan)) == 1


@pytest.mark.parametrize("lost", range(8))
def test_a_kill_at_the_moment_of_the_start_leaves_its_start_up_with_its_limits(lost: int) -> None:
    world = back_to_a_start()
    before = len(world.journal.events)
    world.order(Verb.START, "restart")
    world.tick(1)
    world = killed(world, max(before, len(world.journal.events) - lost))
    known = any(e.cause is Cause.PERSON for e in world.journal.of(WriteIntended))
    world.tick(2)
    if not known:  # whoever brought the plant there, nobody is known to have started it
        assert len(world.journal.of(StartUpBegan)) == 1
        hot(world)
        assert world.journal.of(Tripped)
    elif world.seen[-1].state == "waiting":
        assert [e.since_s > 15.0 for e in world.journal.of(StartUpBegan)] == [False, True]
        hot(world)
        assert world.journal.of(Tripped) == []
    else:
        assert world.seen[-1].state == "shut" and len(world.journal.of(StartUpBegan)) == 1


def ready(**values: float) -> World:
    """After a fallback and a reset, in closed loop and at rest, ready to be started unless ``values`` forbid it."""
    world = back_to_a_start()
    world.tick(10)
    world.vessel.wire.clear()
    world.tick(1, **values)
    return world


def started(world: World) -> PersonHeard:
    world.order(Verb.START, "restart")
    world.tick(1)
    return world.journal.of(PersonHeard)[-1]


def test_a_start_is_refused_on_a_violated_limit_by_its_name_as_a_request_would_be() -> None:
    ready_now = ready()
    assert started(ready_now).done and ready_now.sent
    above = ready()
    above.vessel.values["L"] = 12.1  # not long enough for a trip
    heard = started(above)
    assert not heard.done and heard.check == "LIM-FULL" and "'L <= 12' is violated by" in heard.reason
    assert above.sent == [] and above.guard.latched is None
    above.vessel.values["L"] = 3.0
    above.tick(1)
    assert started(above).done


def test_a_start_is_refused_while_a_limit_is_half_way_to_a_trip_or_cannot_be_judged() -> None:
    near = ready(L=12.3)
    near.vessel.values["L"] = 11.99
    assert started(near).check == "LIM-FULL" and near.sent == []
    blind = ready()
    blind.vessel.values["T"] = math.nan
    heard = started(blind)
    assert heard.check == "CHK-OPEN", "what the transition reads is not known"
    level = ready()
    level.vessel.values["L"] = math.nan
    assert started(level).check == "LIM-FULL" and level.sent == []
    silent = ready()
    silent.silent(8)
    silent.order(Verb.START, "restart")
    silent.silent(1)
    assert not silent.journal.of(PersonHeard)[-1].done and silent.sent == []


def test_a_start_names_the_check_that_it_fails() -> None:
    hot_vessel = ready(T=311.5)
    assert started(hot_vessel).check == "CHK-OPEN"
    world = ready()
    world.order(Verb.OUT_OF_SERVICE, "V.man", reason="maintenance")
    assert started(world).check == "CHK-SERVICE" and world.sent == []


def test_the_limits_of_start_up_end_when_the_plant_could_leave_it_whoever_keeps_it_there() -> None:
    world = World()
    world.tick(3, L=4.0, T=340.0)
    assert world.guard.latched is None
    world.order(Verb.OUT_OF_SERVICE, "F.sp", reason="maintenance")
    world.tick(20, L=8.0)
    assert world.seen[-1].state != "running" and world.guard.latched is not None
