"""Writes that a dead guard has left open: what each is read to have become, and what that means for the next life."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import SequenceLoaded, StartUpBegan, StartUpEnded, StateEntered, StepTaken
from homeostat.domain.events.people import AlarmRaised, ServiceChanged
from homeostat.domain.events.trips import FallbackStands, Latched
from homeostat.domain.events.writes import Cause, ReadBack, StepLoaded, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.mode import Mode
from homeostat.domain.recovery import Command
from homeostat.guard.restart.memory import Memory, OpenWrite
from homeostat.guard.settings import GuardSettings
from homeostat.guard.writing.flight import PUT_RIGHT
from tests.guard.test_memory import FALLBACK, GIVEN_UP, REQUEST, STEPS, intended, remembered
from tests.guard.vessel import ADJUSTED, DRAIN, POUR, RULES, Vessel, World

FEED = (Command("F.sp", 0.03, 0.005),)
RUNNING = StateEntered("running")
LOADED = SequenceLoaded("r1", "running", STEPS, False)
TAKEN = StepTaken("start", "running")
ALL = ("X.cmd", "F.sp", "V.man")


def restarted(*events: Any, memory: Memory | None = None, **accepted: float | None) -> World:
    """A guard that comes with a journal of ``events`` to a vessel that holds ``accepted``; after its first reading."""
    world = World(memory=memory or remembered(*events), vessel=Vessel(**accepted))
    world.tick()
    assert not [name for name in world.alarms if name.startswith("guard:")]
    return world


def step(number: int, name: str = "start", **rest: Any) -> WriteIntended:
    return intended(number, Cause.SEQUENCE, name, **({"commands": FEED} | rest))


def causes(world: World, alarm: str) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == alarm]


def way(world: World) -> list[str]:
    """Names of the transitions that wait."""
    return [s.transition.name for s in world.seen[-1].rest.then]


def test_a_tag_that_was_out_of_service_stays_out() -> None:
    world = restarted(RUNNING, ServiceChanged("T.sp", False, "Ada", "repair"))
    assert world.guard.out_of_service == {"T.sp"}


def test_a_guard_that_died_before_it_said_anything_begins_at_the_beginning() -> None:
    world = restarted(memory=Memory())
    assert world.seen[-1].state == "running" and world.sent == [FEED] and world.alarms == set()
    world = restarted(memory=Memory(waiting=()))
    assert world.seen[-1].state == "waiting" and world.sent == []


def test_a_start_up_that_was_left_at_the_moment_of_death_has_ended() -> None:
    world = restarted(StartUpBegan("waiting", 0.5), RUNNING, F_sp=0.03)
    assert [e.reason for e in world.journal.of(StartUpEnded)] == ["it was left"]
    world = restarted(StartUpBegan("waiting", 0.5), StartUpEnded("waiting", "it was left"), RUNNING, F_sp=0.03)
    assert world.journal.of(StartUpEnded) == [] and world.journal.of(StartUpBegan) == []


def test_a_fallback_is_sent_at_its_time_where_the_plant_says_nothing() -> None:
    world = World(memory=remembered(FALLBACK), settings=GuardSettings(again_s=3.0, sync_s=5.0))
    world.silent(3)
    assert world.sent == []
    world.silent()
    assert world.vessel.wire == [(4.0, DRAIN.actions.commands)] and world.alarms >= {"latched"}
    assert not [name for name in world.alarms if name.startswith("guard:")]


def test_a_latch_under_which_nothing_could_be_sent_sends_what_can_be_sent_now() -> None:
    world = restarted(RUNNING, Latched("hot"))
    assert world.sent == [DRAIN.actions.commands] and world.guard.latched == "hot"


def test_that_a_fallback_stands_is_said_by_the_next_life_where_the_last_one_could_not() -> None:
    held = {"X_cmd": 0.0, "F_sp": 0.0, "V_man": 1.0}
    world = restarted(FALLBACK, ReadBack(4, ALL), **held)
    assert [(e, at_s) for e, at_s in world.journal.events if isinstance(e, FallbackStands)] == [
        (FallbackStands("drain"), 1.0)
    ]
    world = restarted(FALLBACK, ReadBack(4, ALL), FallbackStands("drain"), **held)
    assert world.journal.of(FallbackStands) == [] and world.sent == []


@pytest.mark.parametrize(
    ("accepted", "confirmed", "deviating"),
    [({"X_cmd": 0.0}, ("X.cmd", "F.sp"), ("V.man",)), ({"F_sp": 0.03, "V_man": 1.0}, ("V.man",), ("X.cmd", "F.sp"))],
)
def test_what_was_carried_out_and_what_was_not_is_journalled(
    accepted: dict[str, float], confirmed: tuple[str, ...], deviating: tuple[str, ...]
) -> None:
    world = restarted(FALLBACK, **accepted)
    assert world.journal.of(ReadBack)[0] == ReadBack(4, confirmed, deviating)
    assert world.sent == [DRAIN.actions.commands] and causes(world, "write:half") == []


@pytest.mark.parametrize(("value", "held"), [(2.0, True), (2.0005, False), (1.9995, False), (3.0, False)])
def test_a_tag_that_the_tables_do_not_know_any_more_has_no_tolerance(value: float, held: bool) -> None:
    old = intended(3, Cause.REQUEST, "r1", commands=(Command("Q.sp", 2.0, None), Command("T.sp", 310.0, 0.5)))
    world = restarted(RUNNING, old, Q_sp=value, F_sp=0.03)
    assert world.journal.of(ReadBack)[0].deviating == (() if held else ("Q.sp",))


def test_a_step_that_counts_as_taken_is_sent_again() -> None:
    for events in ((step(2), TAKEN), (step(2), TAKEN, ReadBack(2, (), ("F.sp",)))):
        world = restarted(*events)
        assert world.sent == [FEED] and world.seen[-1].state == "running"


def test_a_step_that_counts_as_taken_is_not_sent_again_where_something_came_between() -> None:
    given_up = WriteEnded(2, 1, WriteResult.GIVEN_UP, "a fallback acts")
    assert restarted(step(2), TAKEN, given_up).sent == []
    for latched in ((step(2), TAKEN), (step(2), TAKEN, ReadBack(2, (), ("F.sp",)))):
        world = restarted(*latched, Latched("hot"))
        world.vessel.wire.clear()
        world.tick(10)
        assert FEED not in world.sent


def test_a_step_that_the_plant_holds_is_taken_and_not_sent_again() -> None:
    world = restarted(step(2), F_sp=0.03)
    assert world.journal.of(StepTaken) == [TAKEN] and world.sent == [] and world.seen[-1].state == "running"
    held = {"F_sp": 0.0, "V_man": 1.0}
    pour = step(4, "empty", commands=POUR.commands, state="emptying")
    assert restarted(RUNNING, SequenceLoaded("r1", "running", (), False), pour, **held).journal.of(StepTaken) == []
    world = restarted(LOADED, step(4, "end", commands=POUR.commands, state="rest"), **held)
    assert world.journal.of(StepTaken) == [] and way(world) == ["empty"]
    world = restarted(LOADED, pour, StepTaken("empty", "emptying"), **held)
    assert world.journal.of(StepTaken) == [] and world.seen[-1].state == "emptying"


HELD = {"T_sp": 305.0, "F_sp": 0.02}


def test_a_request_that_the_plant_holds_brings_its_later_steps_once() -> None:
    world = restarted(RUNNING, REQUEST, **HELD)
    assert [(e, at_s) for e, at_s in world.journal.events if isinstance(e, SequenceLoaded)] == [(LOADED, 1.0)]
    assert way(world) == ["empty"]
    world = restarted(RUNNING, REQUEST, LOADED, **HELD)
    assert world.journal.of(SequenceLoaded) == [] and way(world) == ["empty"]
    world = restarted(RUNNING, REQUEST, GIVEN_UP, **HELD)
    assert world.journal.of(SequenceLoaded) == [] and way(world) == []


def test_only_the_last_write_moves_the_sequence() -> None:
    old = OpenWrite(Cause.REQUEST, "r1", ADJUSTED.commands, "running", (("empty", POUR.commands),), False)
    last = OpenWrite(Cause.REQUEST, "r2", (Command("X.cmd", 0.5, None),), "running", (), False)
    memory = Memory(Mode.CLOSED_LOOP, state="running", waiting=(), writes=4, open={3: old, 4: last}, last=last)
    world = restarted(memory=memory, **HELD)
    assert [e.write for e in world.journal.of(ReadBack)] == [3, 4]
    assert world.journal.of(SequenceLoaded) == [] and way(world) == []


def test_what_was_put_right_belongs_to_no_strategy() -> None:
    later = SequenceLoaded("drain", "shut", (StepLoaded("restart", ()),), True)
    right = intended(5, Cause.FALLBACK, PUT_RIGHT, commands=(Command("V.man", 1.0, 0.2),), state="shut")
    events = FALLBACK, later, ReadBack(4, ("X.cmd",)), FallbackStands("drain"), right
    held = {"X_cmd": 0.0, "F_sp": 0.0}
    world = restarted(*events, **held, V_man=1.0)
    assert world.journal.of(FallbackStands) == [] and world.journal.of(SequenceLoaded) == [] and world.sent == []
    world = restarted(*events, **held, V_man=0.5)
    assert world.sent == [DRAIN.actions.commands] and causes(world, "write:half") == []


def test_a_fallback_that_was_replaced_by_another_does_not_stand_for_it() -> None:
    close = intended(5, Cause.FALLBACK, "close", commands=(Command("X.cmd", 0.5, None),), state="shut")
    world = restarted(FALLBACK, close, X_cmd=0.0, F_sp=0.0, V_man=1.0)
    assert [e.write for e in world.journal.of(ReadBack)] == [4, 5]
    assert world.journal.of(FallbackStands) == [] and world.sent != []


def test_a_write_of_which_a_part_was_carried_out_is_told_and_another_is_not() -> None:
    assert causes(restarted(RUNNING, REQUEST, T_sp=305.0, F_sp=0.0), "write:half") == [
        "write 3 (r1) was carried out in part: not F.sp"
    ]
    assert causes(restarted(RUNNING, REQUEST, F_sp=0.0), "write:half") == []
    assert causes(restarted(RUNNING, REQUEST, LOADED, F_sp=0.0), "write:half") == [
        "write 3 (r1) was carried out in part: not T.sp, F.sp"
    ]


def test_only_what_was_to_follow_a_request_that_came_to_nothing_is_dropped() -> None:
    assert way(restarted(RUNNING, REQUEST, LOADED, T_sp=305.0, F_sp=0.0)) == []
    before = SequenceLoaded("r0", "running", STEPS, False)
    assert way(restarted(before, REQUEST, T_sp=305.0, F_sp=0.0)) == ["empty"], "it was not taken"
    start = intended(3, Cause.PERSON, "Ada", steps=STEPS)
    assert way(restarted(start, LOADED, T_sp=305.0, F_sp=0.0)) == []
    later = SequenceLoaded("drain", "shut", (StepLoaded("restart", ()),), True)
    events = REQUEST, LOADED, GIVEN_UP, FALLBACK, later, ReadBack(4, ALL), FallbackStands("drain")
    world = restarted(*events, X_cmd=0.0, F_sp=0.0, V_man=1.0)
    assert 3 in {e.write for e in world.journal.of(ReadBack)}
    assert remembered(*events).waiting == (("restart", ()),) and world.journal.of(SequenceLoaded) == []


def test_steps_that_make_no_path_are_not_gone_on_with() -> None:
    wrong = SequenceLoaded("r1", "running", (StepLoaded("end", ()), StepLoaded("empty", ())), False)
    world = restarted(wrong)
    assert way(world) == [] and [(a.id, a.priority.name) for a in world.guard.alarms] == [("sequence", "HIGH")]
    assert causes(world, "sequence") == [
        "the sequence cannot go on where the journal says that it stood: "
        "'end' ends in 'rest', but 'empty' leaves 'running'"
    ]
    gone = replace(RULES, nominal=())
    assert World(memory=remembered(RUNNING), rules=gone).tick().state == "running"
