"""A restart at its edges: what is void, what is owed and to whom, and what was carried out in part."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.events.guard import SequenceLoaded, StepTaken
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import FallbackStands, Latched
from homeostat.domain.events.writes import Cause, ReadBack, StepLoaded, WriteIntended
from homeostat.domain.mode import Mode
from homeostat.domain.recovery import Command
from homeostat.guard.restart.memory import Memory, OpenWrite
from tests.guard.test_memory import FALLBACK, POUR, STEPS, intended, remembered, restarted
from tests.guard.vessel import ADJUSTED, Vessel, World

FEED = Command("F.sp", 0.03, 0.005)


def opened(cause: Cause, source: str, *commands: Command, **rest: object) -> OpenWrite:
    state = {Cause.SEQUENCE: "emptying" if source == "empty" else "running"}.get(cause, "running")
    return OpenWrite(cause, source, commands, state, (), taken=bool(rest.pop("taken", False)), **rest)  # type: ignore[arg-type]


def died(*writes: OpenWrite, **rest: object) -> Memory:
    """A memory with these open writes, the last of them the last that was intended."""
    given = {"mode": Mode.CLOSED_LOOP, "state": "running", "waiting": ()} | rest
    numbered = dict(enumerate(writes, 1))
    return Memory(writes=len(writes), open=numbered, last=writes[-1], **given)  # type: ignore[arg-type]


def tripped(memory: Memory, vessel: Vessel) -> World:
    """A restart that trips before it has read the plant, on a link that takes nothing; the level then falls."""
    vessel.raises = True
    world = World(memory=memory, vessel=vessel)
    vessel.values["L"] = 14.0
    blind = replace(vessel.sample(), accepted={})
    world.seen.append(world.guard.tick(blind.at_s, blind))
    assert world.guard.latched is not None
    world.tick(30, L=8.0)
    return world


def sources(world: World, cause: Cause) -> set[str]:
    return {e.source for e in world.journal.of(WriteIntended) if e.cause is cause}


def test_what_was_asked_before_a_trip_moves_no_sequence_though_the_plant_holds_it() -> None:
    asked = replace(opened(Cause.REQUEST, "r1", *ADJUSTED.commands), steps=(POUR,))
    world = tripped(died(asked), Vessel(T_sp=305.0, F_sp=0.02))
    assert "r1" not in {e.source for e in world.journal.of(SequenceLoaded)}
    assert world.journal.of(ReadBack)[0].deviating == (), "the plant holds it"


def test_a_step_that_is_owed_is_void_where_a_trip_came_first() -> None:
    world = tripped(died(opened(Cause.SEQUENCE, "start", FEED, taken=True)), Vessel())
    assert sources(world, Cause.SEQUENCE) == set() and sources(world, Cause.FALLBACK) == {"drain", "close"}


def test_a_step_of_a_fallback_that_is_sent_again_is_not_owed_beside_it() -> None:
    later = SequenceLoaded("drain", "shut", STEPS, True)
    step = intended(5, Cause.SEQUENCE, "empty", commands=POUR[1], state="emptying")
    memory = remembered(FALLBACK, Latched("full"), later, step, StepTaken("empty", "emptying"))
    vessel = Vessel(F_sp=0.03)
    vessel.raises = True
    world = restarted(memory, vessel)
    world.tick(30)
    assert sources(world, Cause.SEQUENCE) == set() and "drain" in sources(world, Cause.FALLBACK)


def test_a_request_that_has_the_name_of_a_fallback_does_not_make_it_stand() -> None:
    memory = remembered(FALLBACK, intended(5, Cause.REQUEST, "drain", commands=(FEED,)))
    world = restarted(memory)
    world.vessel.ignores = True
    world.tick(3)
    assert world.journal.of(FallbackStands) == [] and not world.guard._latch.standing
    assert world.journal.of(ReadBack)[1].deviating == ()


def test_of_the_steps_that_wait_the_one_that_was_carried_out_is_taken() -> None:
    waiting = SequenceLoaded("", "waiting", (StepLoaded("start", (FEED,)), *STEPS), False)
    world = restarted(remembered(waiting, intended(2, Cause.SEQUENCE, "start", commands=(FEED,))))
    world.tick(2)
    assert world.seen[-1].state == "running" and world.sent == []
    assert [e.transition for e in world.journal.of(StepTaken)] == ["start"]


def half(world: World) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "write:half"]


def test_a_part_of_a_step_that_does_not_count_as_taken_is_an_alarm() -> None:
    both = (FEED, Command("T.sp", 305.0, 0.5))
    world = World(memory=died(opened(Cause.SEQUENCE, "start", *both)), vessel=Vessel(F_sp=0.03))
    world.tick(2)
    assert len(half(world)) == 1 and "not T.sp" in half(world)[0] and not world.guard.carries


def test_behind_a_step_that_was_given_up_the_rest_still_waits() -> None:
    lost = opened(Cause.SEQUENCE, "start", FEED, taken=True, given_up=True)
    world = World(memory=died(lost, waiting=(POUR,)), vessel=Vessel())
    world.tick(2)
    assert len(half(world)) == 1
    world.tick(3, L=9.5)
    assert world.seen[-1].state == "emptying"


@pytest.mark.parametrize(("later", "waits"), [(False, False), (True, True)])
def test_behind_a_request_that_the_plant_does_not_hold_nothing_waits_unless_something_came_after_it(
    later: bool, waits: bool
) -> None:
    asked = opened(Cause.REQUEST, "r1", *ADJUSTED.commands, taken=True)
    after = opened(Cause.REQUEST, "r2", Command("T.sp", 310.0, 0.5), taken=True)
    world = World(memory=died(asked, *([after] if later else []), waiting=(POUR,)), vessel=Vessel())
    world.tick(4, L=9.5)
    assert (world.seen[-1].state == "emptying") is waits and len(half(world)) == 1


@pytest.mark.parametrize(("target", "held"), [(0.0304, True), (0.0306, False)])
def test_what_the_plant_rounds_was_carried_out(target: float, held: bool) -> None:
    world = restarted(died(opened(Cause.SEQUENCE, "start", FEED, taken=True)), Vessel(F_sp=target))
    world.tick(1)
    assert (world.journal.of(ReadBack)[0].deviating == ()) is held


def test_of_the_steps_that_the_tables_do_not_know_the_first_is_named() -> None:
    gone = SequenceLoaded("r1", "running", (StepLoaded("gone", ()), StepLoaded("lost", ())), False)
    world = restarted(remembered(gone))
    world.tick()
    (cause,) = [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "sequence"]
    assert "'gone'" in cause
