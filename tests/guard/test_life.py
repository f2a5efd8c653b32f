"""How a guard begins, what it is told while it lives, how long it waits for recovery, and how it ends."""

from __future__ import annotations

import math
from typing import Any

import pytest

from homeostat.domain.events.guard import Armed, GuardStarted, Stopped
from homeostat.domain.events.people import AlarmRaised, ModeEntered
from homeostat.domain.events.trips import Latched
from homeostat.domain.events.writes import WriteEnded, WriteResult
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.observation import Arm, FallBack
from tests.guard.test_lapse import Sheds
from tests.guard.vessel import DRAIN, RULES, World, running, statuses


def causes(world: World, alarm: str) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == alarm]


@pytest.mark.parametrize(("mode", "recipe"), [(Mode.CLOSED_LOOP, "guard"), (Mode.OBSERVE, "plant")])
def test_the_first_events_say_what_began_and_in_which_mode(mode: Mode, recipe: str) -> None:
    world = World(mode=mode)
    world.tick(3)
    assert world.journal.of(GuardStarted) == [GuardStarted(RULES.plant, RULES.configuration, mode.value, recipe, False)]
    assert world.journal.of(ModeEntered) == [ModeEntered(mode.value, "")] and world.alarms == set()


def test_without_a_lease_it_begins_in_observe_and_says_why() -> None:
    vessel = Sheds()
    vessel.keeps = True
    world = World(vessel=vessel)
    world.tick(3)
    assert world.guard.mode is Mode.OBSERVE and world.sent == [] and vessel.leases == 0
    assert causes(world, "mode") == ["the plant gives no lease: somebody else has it"] and "mode" in world.alarms
    assert world.journal.of(GuardStarted)[0].mode == "observe"


def test_a_wanted_stop_gives_up_what_is_under_way_writes_nothing_and_answers_everybody() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask()
    world.tick()
    world.guard.stop("the shift is over")
    world.guard.stop("again")
    assert world.journal.of(Stopped) == [Stopped("the shift is over")] and world.vessel.given_back == 1
    ended = world.journal.of(WriteEnded)[-1]
    assert (ended.result, ended.detail) == (WriteResult.GIVEN_UP, "the shift is over")
    beats, events = len(world.vessel.beats), len(world.journal.events)
    world.ask(name="r2")
    world.tick(5, L=14.0)
    assert len(world.sent) == 1 and len(world.vessel.beats) == beats and len(world.journal.events) == events
    assert statuses(world)[-1] == "withdrawn" and statuses(world, "r2") == []


def test_a_stop_before_the_first_tick_is_journalled_at_0_s() -> None:
    world = World()
    world.guard.stop("not today")
    assert world.journal.events == [(Stopped("not today"), 0.0)] and world.vessel.given_back == 0
    world.tick(3)
    assert world.sent == [] and world.vessel.leases == 0


def test_a_stop_is_journalled_when_it_came() -> None:
    world = running()
    world.guard.stop("done")
    assert world.journal.events[-1] == (Stopped("done"), 4.0)


def test_recovery_has_until_the_time_that_it_named_and_no_longer() -> None:
    world = running()
    world.guard.mailbox.put(Arm(("close",), 7.0))
    world.tick(2)
    assert world.guard.latched is None and world.journal.of(Armed) == [Armed(("close", "drain"), 7.0)]
    world.tick()
    assert world.guard.latched == "recovery has not acted in the time that physics leaves"
    assert [at_s for e, at_s in world.journal.events if isinstance(e, Latched)] == [7.0]


def test_a_request_that_is_being_written_or_stands_has_met_its_time() -> None:
    world = running()
    world.guard.mailbox.put(Arm((), 6.0))
    world.vessel.silent = True
    world.vessel.ignores = True
    world.ask()
    world.tick(2)
    assert world.guard.latched is None, "it is on its way"
    world.vessel.silent = world.vessel.ignores = False
    world.tick(10)
    assert statuses(world)[-1] == "confirmed" and world.guard.latched is None


def test_in_observe_a_time_that_passes_is_an_alarm_once() -> None:
    world = World(mode=Mode.OBSERVE)
    world.tick(4)
    world.guard.mailbox.put(Arm((), 6.0))
    world.tick(6)
    assert causes(world, "fallback wanted") == ["recovery has not acted in the time that physics leaves"]
    assert world.guard.latched is None and world.sent == []


@pytest.mark.parametrize("by_s", [math.nan, math.inf, -math.inf])
def test_a_time_that_is_none_arms_nothing(by_s: float) -> None:
    world = running()
    world.guard.mailbox.put(Arm(("close",), by_s))
    world.tick(3)
    assert world.journal.of(Armed) == [] and world.guard.latched is None
    assert causes(world, "mailbox") == [f"a message could not be taken: fallbacks cannot be armed to act by {by_s!r} s"]


def test_while_one_acts_nothing_is_armed() -> None:
    world = running()
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(2)
    world.guard.mailbox.put(Arm(("close",), 6.5))
    world.tick(3)
    assert world.journal.of(Armed) == [] and world.sent == [DRAIN.actions.commands]


def test_recovery_may_have_a_fallback_act_and_its_reason_is_cut() -> None:
    world = running()
    world.guard.mailbox.put(FallBack("x" * 600))
    world.tick()
    assert world.guard.latched == "x" * 500 and world.sent == [DRAIN.actions.commands]


@pytest.mark.parametrize("message", [7, None, "close the valve"])
def test_what_nobody_knows_is_an_alarm_and_no_more(message: Any) -> None:
    world = running()
    world.guard.mailbox.put(message)
    world.tick(2)
    known = f"nobody knows what {type(message).__name__!r} asks for"
    assert causes(world, "mailbox") == [f"a message could not be taken: {known}"] and world.alarms == set()
    assert world.sent == []
