"""Starts that the plant takes and does not hold: nothing follows them, whatever comes between."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import SequenceLoaded
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Verb
from homeostat.domain.recovery import Command, Step
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_memory import Line
from tests.guard.test_orders import START, reset, shut
from tests.guard.test_people import tell
from tests.guard.vessel import DRAIN, MACHINE, RULES, Journal, Vessel, World, awaited


def unheld(**rest: Any) -> World:
    """A start whose targets the link takes and the plant does not hold; the vessel could go on at once."""
    world = reset(ignores=True, **rest)
    assert tell(world, Verb.START, "restart").done and world.seen[-1].state == "waiting"
    assert [s.transition.name for s in world.seen[-1].rest.then] == ["start", "empty", "end"]
    return world


def test_nothing_follows_a_start_that_the_plant_takes_and_does_not_hold() -> None:
    world = unheld()
    world.tick(12, L=8.0)
    assert world.sent == [START] * 3 and "write:person" in world.alarms
    assert world.seen[-1].rest.then == () and world.seen[-1].state == "waiting"
    world.vessel.ignores = False
    world.tick(20, L=8.0)
    assert world.sent == [START] * 3, "what was to follow was meant for a plant that had started"


def test_a_start_that_is_held_at_another_value_stops_as_well() -> None:
    world = reset()
    world.vessel.accepts_first = 2
    assert tell(world, Verb.START, "restart").done
    world.tick(12, L=8.0)
    assert world.seen[-1].rest.then == () and {"write:person", "write:half"} & world.alarms == {"write:person"}
    assert all(commands == START for commands in world.sent)


def test_a_start_that_is_held_in_time_goes_on() -> None:
    world = unheld()
    world.vessel.ignores = False
    world.tick(6, L=8.0)
    assert world.seen[-1].state == "running" and "write:person" not in world.alarms


def test_a_start_that_the_mode_overtakes_before_the_plant_was_read_leaves_no_step_behind() -> None:
    world = unheld()
    assert tell(world, Verb.MODE, "approve").done
    assert world.journal.of(SequenceLoaded)[-1] == SequenceLoaded("restart", "waiting", (), False)
    said = [e for e in world.journal.of(AlarmRaised) if e.alarm == "write:person"]
    assert [(e.cause, e.priority) for e in said] == [
        (
            "Ada changed the mode to 'approve' before the plant was read to hold 'restart': nothing follows it",
            Priority.HIGH,
        )
    ]
    world.vessel.ignores = False
    world.tick(12, L=8.0)
    assert world.sent == [START] and world.seen[-1].rest.then == ()


def test_a_start_on_a_wire_that_is_lost_leaves_no_step_behind() -> None:
    world = unheld()
    world.vessel.beat = broken  # type: ignore[method-assign]
    world.tick(1)
    assert "heartbeat" in world.alarms
    del world.vessel.beat  # type: ignore[attr-defined]
    world.vessel.ignores = False
    world.tick(20, L=8.0)
    assert "heartbeat" not in world.alarms and world.seen[-1].rest.then == () and world.sent == [START]


def broken() -> None:
    raise TimeoutError("no answer")


def test_a_fallback_that_overtakes_a_start_keeps_its_own_steps() -> None:
    dry = awaited("dry", "shut", "rest", "L <= 1")
    machine = replace(MACHINE, transitions=(*MACHINE.transitions, dry))
    drain = replace(DRAIN, actions=replace(DRAIN.actions, then=(Step(dry, (Command("F.sp", 0.0, 0.005),)),)))
    world = shut(replace(RULES, machine=machine, fallbacks=(drain,)), vessel=Vessel(F_sp=0.0, X_cmd=0.0, V_man=1.0))
    world.tick(2)
    world.vessel.ignores = True
    assert tell(world, Verb.START, "restart").done and world.seen[-1].state == "waiting"
    world.vessel.ignores = False
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(3)
    assert world.guard.latched is not None and [s.transition for s in world.seen[-1].rest.then] == [dry]


@pytest.mark.parametrize("ticks", [0, 3, 12])
def test_a_kill_lets_no_step_follow_a_start_that_is_not_held(ticks: int) -> None:
    world = unheld()
    world.tick(ticks, L=8.0)
    world.vessel.values["L"] = 8.0
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in world.journal.events)
    again = World(vessel=world.vessel, memory=memory, record=Journal(world.journal.events))
    again.tick(1)
    world.vessel.ignores = False
    again.tick(15)
    assert [w.cause.value for w in again.journal.of(WriteIntended)][-1] == "person"
    assert again.seen[-1].rest.then == ()
