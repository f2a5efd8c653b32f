"""Steps of the sequence: taken once the plant has got them, owed until it holds them, never while nobody may write."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.events.guard import StateEntered, StepTaken
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy, Step
from tests.guard.vessel import (
    ADJUSTED,
    BEGIN,
    CLOSE,
    DRAIN,
    MACHINE,
    POUR,
    ROUTE,
    RULES,
    World,
    awaited,
    finding,
    running,
    statuses,
)


def times(world: World) -> list[float]:
    """When something was sent [s]."""
    return [at_s for at_s, _ in world.vessel.wire]


def taken(world: World) -> list[tuple[StepTaken, float]]:
    return [(event, at_s) for event, at_s in world.journal.events if isinstance(event, StepTaken)]


def order(world: World, verb: Verb, subject: str) -> None:
    world.order(verb, str(subject), reason="a test")
    world.tick()


def owed() -> World:
    """A world whose plant has been told to begin and does not; read to have failed at 7 s."""
    world = World()
    world.vessel.ignores = True
    world.tick(7)
    assert times(world) == [1.0, 3.0, 5.0] and "write:sequence" in world.alarms
    world.vessel.ignores = False
    return world


def test_a_step_is_journalled_with_the_time_at_which_the_plant_has_got_it() -> None:
    world = World()
    world.tick(3)
    assert taken(world) == [(StepTaken("start", "running"), 1.0)]
    entered = [(event, at_s) for event, at_s in world.journal.events if isinstance(event, StateEntered)]
    assert entered == [(StateEntered("running"), 1.0)] and world.alarms == set()


def test_a_step_that_the_link_has_not_answered_is_not_taken_before_it_is_read_to_stand() -> None:
    world = World()
    world.vessel.hangs = True
    world.tick(2)
    assert world.seen[-1].state == "waiting" and taken(world) == [] and world.alarms == set()
    world = World()
    world.vessel.silent = True  # it is carried out, and never answered
    world.tick()
    assert world.seen[-1].state == "waiting"
    world.tick(3)
    assert taken(world) == [(StepTaken("start", "running"), 2.0)] and len(world.sent) == 1 and world.alarms == set()


def test_without_a_sample_nothing_is_due_and_nothing_breaks() -> None:
    world = World()
    world.silent(3)
    assert world.sent == [] and world.alarms == {"link"}
    assert world.tick().state == "running"


@pytest.mark.parametrize("mode", [Mode.OBSERVE, Mode.ADVISE])
def test_where_nobody_writes_a_fallback_s_later_step_stands_and_says_why(mode: Mode) -> None:
    slow = FallbackStrategy("slow", ActionSet((Command("F.sp", 0.0, 0.005),), "running", (POUR,)))
    world = running(rules=replace(RULES, fallbacks=(slow,)))
    world.tick(12, T=325.0, L=8.0)
    assert world.guard.latched is not None
    world.order(Verb.MODE, mode.value)
    sent = len(world.sent)
    assert world.tick(3, L=9.5).refused == f"in mode '{mode}' nobody writes"
    assert len(world.sent) == sent and world.seen[-1].state == "running"


def test_where_nobody_writes_the_recipe_of_the_plant_is_followed() -> None:
    world = World(mode=Mode.OBSERVE, rules=replace(RULES, recipe=Side.PLANT))
    world.tick(3)
    assert world.seen[-1].refused is None and world.seen[-1].state == "running"
    assert taken(world) == [(StepTaken("start", "running"), 1.0)] and world.sent == []


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (Command("F.sp", 0.06, 0.005), "admitted are 0 to 0.05 L/s"),
        (Command("F.sp", 0.03, 1.0), "ramps at 1 L/s/s"),
        (Command("Q.cmd", 0.03, None), "'Q.cmd' is not a tag that may be written"),
    ],
)
def test_a_step_of_the_tables_that_may_not_be_written_is_not(command: Command, why: str) -> None:
    world = World(rules=replace(RULES, nominal=(replace(BEGIN, commands=(command,)),)))
    world.tick(3)
    refused = world.seen[-1].refused
    assert refused is not None and why in refused and world.sent == [] and world.seen[-1].state == "waiting"


def test_a_step_waits_for_a_tag_that_a_person_has() -> None:
    world = World()
    world.tick(L=4.0)
    order(world, Verb.OUT_OF_SERVICE, "F.sp")
    assert world.tick(3, L=8.0).refused == "'F.sp' is out of service" and world.sent == []
    order(world, Verb.IN_SERVICE, "F.sp")
    assert world.tick().refused is None and world.sent == [BEGIN.commands]


def test_a_step_that_counts_as_taken_is_sent_again_10_s_after_it_failed() -> None:
    world = owed()
    world.tick(20)
    assert times(world) == [1.0, 3.0, 5.0, 17.0] and len(taken(world)) == 1
    assert world.vessel.accepted["F.sp"] == 0.03 and world.alarms == set()


def test_what_is_owed_waits_for_a_tag_that_a_person_has() -> None:
    world = owed()
    order(world, Verb.OUT_OF_SERVICE, "F.sp")
    assert world.tick(15).refused == "'F.sp' is out of service" and len(world.sent) == 3
    order(world, Verb.IN_SERVICE, "F.sp")
    assert world.seen[-1].refused is None and world.sent[3:] == [BEGIN.commands]
    assert len(taken(world)) == 1


def test_what_is_owed_waits_for_its_permissive() -> None:
    world = owed()
    seen = world.tick(15, L=11.5)
    assert seen.refused is not None and "PRM-FEED" in seen.refused and len(world.sent) == 3
    assert world.tick(2, L=8.0).refused is None and len(world.sent) == 4


def test_what_is_owed_is_a_person_s_matter_once_nobody_writes() -> None:
    world = owed()
    order(world, Verb.MODE, Mode.OBSERVE)
    world.tick(3)
    order(world, Verb.MODE, Mode.CLOSED_LOOP)
    world.tick(30)
    assert len(world.sent) == 3


def test_what_is_owed_is_void_once_something_else_was_released() -> None:
    world = owed()
    world.ask()
    world.tick(30)
    assert statuses(world)[-1] == "confirmed" and world.sent[3:] == [ADJUSTED.commands]


def test_a_step_that_a_change_of_the_mode_overtakes_is_sent_again_until_the_plant_holds_it() -> None:
    world = World()
    world.vessel.ignores = True
    world.tick()
    world.vessel.ignores = False
    order(world, Verb.MODE, Mode.APPROVE)
    world.tick(3)
    assert world.vessel.accepted["F.sp"] == 0.03 and len(taken(world)) == 1 and len(world.sent) == 2
    world.tick(30)
    assert len(world.sent) == 2


def test_a_request_that_failed_is_not_owed() -> None:
    world = running()
    world.vessel.ignores = True
    world.ask()
    world.tick(12)
    world.vessel.ignores = False
    world.tick(30)
    assert finding(world) == "CHK-OBEYED" and len(world.sent) == 3


def test_a_request_that_failed_does_not_hold_up_the_sequence() -> None:
    world = running(rules=replace(RULES, nominal=(BEGIN, POUR)))
    world.vessel.raises = True
    world.ask()
    world.tick(3)  # at 5, 6 and 7 s
    world.vessel.raises = False
    world.tick(1, L=9.5)
    assert statuses(world)[-1] == "failed" and times(world) == [5.0, 6.0, 7.0, 8.0]
    assert world.sent[-1] == POUR.commands and world.seen[-1].state == "emptying"


COOLING = replace(MACHINE, transitions=(*MACHINE.transitions, awaited("cool", "shut", "emptying", "L <= 5")))
FED = (Command("F.sp", 0.01, 0.005),)
"""PRM-OPEN forbids it while X.cmd is 0, as a fallback leaves it."""


def cooling(*commands: Command) -> World:
    """A world whose fallback stands and has a step of its own, which is due at L <= 5."""
    strategy = replace(CLOSE, actions=replace(CLOSE.actions, then=(Step(COOLING.transitions[-1], commands),)))
    world = running(rules=replace(RULES, machine=COOLING, fallbacks=(strategy,)))
    world.tick(4, L=14.0)
    assert world.sent == [CLOSE.actions.commands]
    return world


def test_a_step_of_a_fallback_is_tried_again_whatever_its_permissives_say() -> None:
    world = cooling(*FED)
    world.vessel.raises = True
    world.tick(2, L=4.0)
    world.vessel.raises = False
    world.tick(2)
    assert world.sent[1:] == [FED] * 3 and world.seen[-1].state == "emptying"


def test_a_step_of_a_fallback_that_writes_nothing_but_a_person_s_tag_is_taken_without_a_write() -> None:
    world = cooling(Command("V.man", 0.5, 0.2))
    world.vessel.accepted["V.man"] = 0.3
    world.tick(2)
    world.tick(3, L=4.0)
    assert world.seen[-1].state == "emptying" and world.sent == [CLOSE.actions.commands]
    assert [event for event, _ in taken(world)] == [StepTaken("start", "running"), StepTaken("cool", "emptying")]


def test_a_step_of_a_fallback_that_is_owed_is_a_person_s_matter_once_nobody_writes() -> None:
    world = cooling(*FED)
    world.vessel.ignores = True
    world.tick(8, L=4.0)
    assert world.seen[-1].state == "emptying" and "write:sequence" in world.alarms
    world.vessel.ignores = False
    order(world, Verb.MODE, Mode.OBSERVE)
    intended = len(world.journal.of(WriteIntended))
    world.tick(30)
    assert len(world.journal.of(WriteIntended)) == intended and world.vessel.accepted["F.sp"] == 0.0
    assert world.guard.latched is not None and world.seen[-1].state == "emptying"


def test_a_step_that_never_reached_the_plant_is_due_again_10_s_after_it_failed() -> None:
    world = World()
    world.vessel.raises = True
    world.tick(6)
    assert taken(world) == [] and "write:sequence" in world.alarms
    failed_s = next(at_s for event, at_s in world.journal.events if getattr(event, "alarm", "") == "write:sequence")
    world.vessel.raises = False
    world.tick(20)
    assert times(world)[3:] == [failed_s + 10.0] and taken(world) == [(StepTaken("start", "running"), failed_s + 10.0)]


def test_a_step_owed_from_before_a_person_s_fallback_is_void() -> None:
    world = running()
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick(2)
    world.vessel.ignores = True
    world.tick(12, L=9.5)  # the step is taken by the link, ignored by the plant, and owed
    world.vessel.ignores = False
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick()
    world.tick(30, L=8.0)
    after = world.sent[world.sent.index(DRAIN.actions.commands) + 1 :]
    assert after == []
