"""One decision per tick: trip before request before sequence."""

from __future__ import annotations

import pytest

from homeostat.domain.events.trips import FallbackActivated, FallbackStands, Latched, Tripped
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Mode
from homeostat.domain.recovery import Command
from tests.guard.vessel import ADJUSTED, DRAIN, ROUTE, Vessel, World, finding, running, statuses

pytestmark = pytest.mark.quick


def test_the_nominal_step_is_written_when_its_guard_holds_and_confirmed_by_reading() -> None:
    world = World()
    world.tick(L=4.0)
    assert world.sent == [] and world.seen[-1].state == "waiting"
    world.tick(L=8.0)
    assert world.sent == [(Command("F.sp", 0.03, 0.005),)]
    assert world.seen[-1].state == "running"
    assert world.seen[-1].entered == (("running", 2.0),)
    world.tick()
    assert "read-back" in world.journal.kinds


def test_a_request_is_verified_written_and_confirmed_within_two_ticks() -> None:
    world = running()
    world.ask()
    world.tick(2)
    assert world.sent == [ADJUSTED.commands]
    assert statuses(world) == ["authorised", "verified", "accepted", "confirmed"]


def test_later_steps_of_a_request_are_written_when_they_are_due() -> None:
    world = running()
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick(2)
    assert world.sent == [ROUTE.commands]
    world.tick(2, L=9.5)
    assert world.sent == [ROUTE.commands, ROUTE.then[0].commands]
    assert world.seen[-1].state == "emptying"


def test_a_violated_limit_trips_at_that_tick_and_the_fallback_stands() -> None:
    world = running()
    world.tick(5, T=313.0 + 2.0)  # as fast as it jumps, it is uncertain for 5 s, in which 8 K s come together
    assert world.seen[-1].latched is None
    world.tick(4)
    assert world.sent[0] == DRAIN.actions.commands
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["drain"]
    assert len(world.journal.of(Latched)) == 1 and len(world.journal.of(FallbackStands)) == 1
    assert world.journal.of(Tripped)[0].limit == "LIM-HOT" and world.journal.of(Tripped)[0].acted


def test_a_trip_does_not_wait_for_a_write_that_hangs() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask()
    world.tick()
    assert world.sent == [ADJUSTED.commands]
    world.tick(1, L=14.0)
    assert world.sent[1:] == [DRAIN.actions.commands]
    assert statuses(world)[-1] == "withdrawn"


def test_nothing_asked_before_a_trip_is_sent_after_it() -> None:
    world = running()
    world.vessel.values["L"] = 14.0
    world.ask()
    world.tick(5)
    assert world.sent == [DRAIN.actions.commands]
    assert statuses(world)[-1] in ("refused", "withdrawn")
    world.ask(name="r2")
    world.tick(3)
    assert statuses(world, "r2")[-1] in ("refused", "withdrawn")


def test_a_fallback_that_is_not_obeyed_is_tried_again_then_the_next_one_then_the_plant_sheds() -> None:
    world = running()
    world.vessel.ignores = True
    world.tick(40, L=14.0)
    assert [e.strategy for e in world.journal.of(FallbackActivated)][:2] == ["drain", "close"]
    attempts = [(e.source, e.attempt) for e in world.journal.of(WriteIntended) if e.cause.value == "fallback"]
    assert attempts[:6] == [("drain", 1), ("drain", 2), ("drain", 3), ("close", 1), ("close", 2), ("close", 3)]
    assert world.vessel.given_back >= 1 and "shed" in world.alarms
    world.vessel.ignores = False
    world.tick(20)
    assert "shed" not in world.alarms
    assert world.journal.of(FallbackStands)[0].strategy in ("drain", "close")


def test_in_observe_a_trip_is_an_alarm_and_nobody_writes() -> None:
    world = World(mode=Mode.OBSERVE, lease=None)
    world.tick(4)
    world.tick(20, L=14.0)
    assert world.sent == [] and world.vessel.beats == []
    assert "trip:LIM-FULL" in world.alarms
    assert not world.journal.of(Tripped)[0].acted and world.guard.latched is None


def test_a_setpoint_that_somebody_moved_is_out_of_service_within_one_tick() -> None:
    world = running()
    world.vessel.accepted["T.sp"] = 300.0
    world.tick()
    assert world.guard.out_of_service == {"T.sp"} and "moved:T.sp" in world.alarms
    world.ask()
    world.tick(2)
    assert world.sent == [] and finding(world) == "CHK-SERVICE"


def test_a_fallback_leaves_out_of_service_tags_alone_unless_its_row_says_so() -> None:
    world = running()
    world.vessel.accepted.update({"V.man": 0.3, "X.cmd": 1.0 - 0.5})
    world.tick()
    assert world.guard.out_of_service == {"V.man", "X.cmd"}
    world.tick(3, L=14.0)
    assert [c.tag for c in world.sent[0]] == ["X.cmd", "F.sp"]


def test_every_tick_beats_in_modes_that_write() -> None:
    world = running()
    assert world.vessel.beats == [1.0, 2.0, 3.0, 4.0]
    world.guard.stop("done")
    assert world.vessel.given_back == 1 and world.sent == []


def test_a_strategy_that_fails_a_check_gives_way_to_the_next() -> None:
    world = running(vessel=Vessel())
    world.guard._parts.service.change("F.sp", False, "Ada", "test", 4.0)
    world.guard._parts.service.change("V.man", False, "Ada", "test", 4.0)
    world.tick(3, L=14.0)
    # Without F.sp the feed would go on against a closed valve: PRM-OPEN forbids both strategies.
    assert world.sent == []
    assert "shed" in world.alarms


def test_a_limit_that_is_violated_again_calls_the_next_strategy() -> None:
    world = running()
    world.tick(5, L=14.0)
    world.tick(20, L=8.0)
    world.tick(5, L=14.0)
    assert [c for c in world.sent if c == DRAIN.actions.commands] == [DRAIN.actions.commands]
    assert len(world.sent) == 2
