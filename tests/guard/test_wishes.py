"""Recovery gives up: in closed loop the fallback acts; where a person has the say that is an alarm and no more."""

from __future__ import annotations

import pytest

from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.observation import Arm, FallBack, Message
from tests.guard.vessel import CLOSE, DRAIN, World, running, statuses

HELD = [Mode.OBSERVE, Mode.ADVISE, Mode.APPROVE]
"""Modes in which recovery's word alone has nothing written."""
WANTED = "fallback wanted"


def causes(world: World) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == WANTED]


def given_up(mode: Mode, *before: Message) -> World:
    """A vessel that runs, and a recovery that has nothing to release."""
    world = running(mode=mode)
    messages: tuple[Message, ...] = (*before, FallBack("no path is admitted"))
    for message in messages:
        world.guard.mailbox.put(message)
    world.tick()
    return world


def test_in_closed_loop_the_fallback_acts_at_once() -> None:
    world = given_up(Mode.CLOSED_LOOP)
    assert world.guard.latched == "no path is admitted" and world.sent == [DRAIN.actions.commands]
    assert causes(world) == []


@pytest.mark.parametrize("mode", HELD)
def test_where_a_person_has_the_say_it_is_an_alarm_that_stays(mode: Mode) -> None:
    world = given_up(mode)
    world.tick(30)
    assert world.guard.latched is None and world.sent == []
    assert causes(world) == ["no path is admitted"] and WANTED in world.alarms


@pytest.mark.parametrize("mode", HELD)
def test_the_alarm_says_what_time_physics_leaves_and_a_word_too_long_is_cut(mode: Mode) -> None:
    world = given_up(mode, Arm(("close",), 20.0))
    assert causes(world) == ["no path is admitted; physics leaves time until 20 s"]
    world = running(mode=mode)
    world.guard.mailbox.put(FallBack("x" * 600))
    world.tick()
    assert causes(world) == ["x" * 500]


def test_in_approve_the_fallback_acts_when_the_time_that_physics_leaves_is_over() -> None:
    world = given_up(Mode.APPROVE, Arm(("close",), 20.0))
    world.tick(14)
    assert world.seen[-1].now_s == 19.0 and world.sent == []
    world.tick()
    assert world.guard.latched == "recovery has not acted in the time that physics leaves"
    assert world.sent == [CLOSE.actions.commands]
    world.tick()
    assert WANTED not in world.alarms, "what was wanted acts"


@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.ADVISE])
def test_where_nobody_writes_that_time_passes_without_another_alarm(mode: Mode) -> None:
    world = given_up(mode, Arm(("close",), 20.0))
    world.tick(30)
    assert len(causes(world)) == 1 and WANTED in world.alarms and world.guard.latched is None


def test_in_approve_a_trip_acts_all_the_same() -> None:
    world = given_up(Mode.APPROVE)
    world.tick(4, T=340.0, Tx=340.0)
    assert world.guard.latched is not None and "LIM-HOT" in world.guard.latched
    assert world.sent and WANTED not in world.alarms


def test_in_approve_a_person_may_order_what_recovery_wants() -> None:
    world = given_up(Mode.APPROVE)
    world.order(Verb.FALL_BACK, reason="do it")
    world.tick(2)
    assert "ordered by Ada: do it" in str(world.guard.latched) and WANTED not in world.alarms
    world.tick(2)
    world.order(Verb.RESET, reason="it was dust")
    world.tick(2)
    assert not world.guard.latched and WANTED not in world.alarms, "it is not wanted again"


def test_in_approve_what_is_asked_afterwards_ends_the_wish_and_waits_for_a_yes() -> None:
    world = given_up(Mode.APPROVE, Arm((), 40.0))
    asked = world.ask()
    world.tick(2)
    assert WANTED not in world.alarms and statuses(world)[-1] == "offered"
    world.order(Verb.APPROVE, asked.id, digest=asked.actions.digest)
    world.tick(40)
    assert statuses(world)[-1] == "confirmed" and world.guard.latched is None


@pytest.mark.parametrize("mode", HELD)
def test_what_is_refused_is_nothing_better(mode: Mode) -> None:
    world = given_up(mode)
    world.order(Verb.OUT_OF_SERVICE, "F.sp", reason="maintenance")
    world.tick()
    world.ask()
    world.tick(2)
    assert statuses(world)[-1] == "refused" and WANTED in world.alarms and len(causes(world)) == 1


def test_brought_from_approve_to_closed_loop_an_old_wish_moves_nothing() -> None:
    world = given_up(Mode.APPROVE)
    world.order(Verb.MODE, "closed-loop")
    world.tick(3)
    assert WANTED not in world.alarms and world.guard.latched is None and world.sent == []


def test_brought_from_observe_to_approve_a_wish_stands() -> None:
    world = given_up(Mode.OBSERVE)
    world.order(Verb.MODE, "approve")
    world.tick(3)
    assert WANTED in world.alarms and world.guard.latched is None


@pytest.mark.parametrize("mode", [Mode.CLOSED_LOOP, Mode.OBSERVE])
def test_a_limit_that_is_violated_under_a_fallback_calls_nobody_for_another_one(mode: Mode) -> None:
    world = running()
    world.tick(1, L=14.0)
    assert world.guard.latched is not None
    world.order(Verb.MODE, mode.value)
    world.tick(4)
    assert world.guard.mode is mode and causes(world) == []


def test_a_trip_where_nobody_writes_names_what_is_violated() -> None:
    world = running(mode=Mode.OBSERVE)
    world.tick(2, L=14.0)
    assert causes(world) == [a.cause for a in world.guard.alarms if a.id == "trip:LIM-FULL"]
