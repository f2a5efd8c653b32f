"""What does not help or was taken by hand gives way: also in a lapse of the lease, after a shed, and over a death."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.trips import FallbackIneffective, FallbackStands, Shed
from homeostat.domain.events.writes import WriteEnded, WriteResult
from homeostat.domain.mode import Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy, Step
from tests.guard.test_effect import BOTH, SHUT, TIMES, acted, full, killed, serving
from tests.guard.test_hands import falling, remembered
from tests.guard.test_lapse import Sheds, causes
from tests.guard.vessel import CLOSE, DRAIN, MACHINE, RULES, World, awaited, running

OPEN = FallbackStrategy("open", ActionSet((Command("V.man", 1.0, 0.2),), "shut"))
LATE = {"LIM-FULL": Effect(60.0)}


def shedding(rules: GuardRules = BOTH, **rest: Any) -> tuple[World, Sheds]:
    """A vessel that is too full, on a plant that may shed, under a fallback that has just been confirmed."""
    vessel = Sheds()
    vessel.tells = True
    world = running(rules=rules, vessel=vessel, **rest)
    world.tick(2, L=14.0)
    while not world.journal.of(FallbackStands):
        world.tick(1)
    vessel.wire.clear()
    return world, vessel


def test_what_the_plant_s_own_control_did_to_a_fallback_in_a_lapse_is_not_blamed_on_the_strategy() -> None:
    world, vessel = shedding()
    world.tick(15)
    vessel.keeps = True
    vessel.shed()
    world.tick(30)
    assert world.journal.of(FallbackIneffective) == [] and world.sent == []
    vessel.keeps = False
    while not world.sent:
        world.tick(1)
    assert world.sent == [(Command("V.man", 1.0, 0.2),)]
    world.tick(19)
    assert acted(world) == ["drain"]
    world.tick(3)
    assert acted(world) == ["drain", "close"], "from now on it has its time, and no more"


def test_a_limit_that_comes_back_in_a_lapse_leaves_the_strategy_that_serves_it_its_time() -> None:
    world, vessel = shedding()
    world.tick(5, L=8.0)
    vessel.keeps = True
    vessel.shed()
    world.tick(3, L=14.0)
    vessel.keeps = False
    world.tick(15)
    assert acted(world) == ["drain"] and vessel.accepted["V.man"] == 1.0


def test_another_limit_in_a_lapse_takes_the_lease_for_the_next_strategy_at_once() -> None:
    world, vessel = shedding(serving({"LIM-FULL": Effect(60.0)}))
    vessel.keeps = True
    vessel.shed()
    world.tick(20)
    vessel.keeps = False
    world.tick(1, T=330.0)
    assert acted(world) == ["drain", "close"] and world.sent == [CLOSE.actions.commands]


def test_what_was_being_put_right_when_the_last_strategy_was_given_up_takes_no_lease_after_the_shed() -> None:
    world = running(rules=replace(BOTH, fallbacks=BOTH.fallbacks[:1]))
    world.vessel.hangs = True
    world.ask()
    world.tick(1)
    world.vessel.hangs = False
    world.tick(1, L=14.0)
    world.tick(17)
    world.vessel.hangs = True
    world.vessel.accepted["T.sp"] = 305.0  # what was asked before the trip arrives late
    world.tick(1)
    assert "late:T.sp" in {a.id for a in world.guard.alarms} and world.sent[-1] == (Command("T.sp", 310.0, 0.5),)
    while not world.journal.of(Shed):
        world.tick(1)
    leases, sent = world.vessel.leases, len(world.sent)
    world.vessel.hangs = False
    world.tick(60)
    assert world.vessel.leases == leases and len(world.sent) == sent and world.vessel.given_back == 1


@pytest.mark.parametrize("give_up", [True, False])
def test_after_a_shed_the_plant_s_own_recipe_is_no_person_and_a_person_is(give_up: bool) -> None:
    world = full() if give_up else running(rules=replace(BOTH, fallbacks=()))
    world.tick(60, L=14.0)
    assert "shed" in world.alarms
    world.vessel.accepted.update({"V.man": None, "F.sp": 0.03})  # BEGIN
    world.tick(3)
    assert world.guard.out_of_service == frozenset()
    world.vessel.accepted["F.sp"] = 0.02
    world.tick(1)
    assert world.guard.out_of_service == {"F.sp"}


def test_a_late_write_after_a_shed_is_left_to_the_plant_s_own_control() -> None:
    world = running(rules=replace(BOTH, fallbacks=()))
    world.vessel.hangs = world.vessel.ignores = True
    world.ask()
    world.tick(1)
    world.tick(30, L=14.0)
    assert world.journal.of(Shed) and world.guard.latched is not None
    world.vessel.hangs = world.vessel.ignores = False
    leases, sent = world.vessel.leases, len(world.sent)
    world.vessel.accepted["T.sp"] = 305.0
    world.tick(30)
    assert world.vessel.leases == leases and len(world.sent) == sent and "late:T.sp" not in world.alarms


def test_the_strategy_that_follows_a_hand_is_one_that_brings_the_violated_limit_back() -> None:
    shut, close = replace(SHUT, serves={"LIM-HOT": Effect(30.0)}), replace(CLOSE, serves=TIMES)
    rules = replace(BOTH, fallbacks=(BOTH.fallbacks[0], shut, close))
    world = falling("F.sp", rules=rules)
    world.tick(3, L=14.0)
    world.vessel.accepted["V.man"] = 0.5
    world.tick(1)
    assert acted(world) == ["drain", "close"] and world.guard.out_of_service == {"V.man"}
    calm = falling("V.man", rules=replace(rules, fallbacks=(replace(OPEN, serves=TIMES), shut, close)))
    calm.order(Verb.FALL_BACK, reason="smoke")
    calm.tick(1)
    calm.vessel.accepted["V.man"] = 0.1
    calm.tick(2)
    assert acted(calm) == ["open", "shut"], "where nothing is violated they stand in their order"


def test_a_strategy_that_was_given_up_does_not_follow_a_hand() -> None:
    last = replace(SHUT, serves=TIMES)
    world = full(rules=replace(BOTH, fallbacks=(BOTH.fallbacks[0], replace(OPEN, serves=TIMES), last)))
    world.vessel.accepted["V.man"] = None
    world.tick(25)
    assert acted(world)[0] == "drain" and "drain" not in acted(world)[1:]
    assert acted(world)[-1] == "shut"


def torn(shut: dict[str, Effect], until_s: int, **values: float) -> World:
    """A lease that is lost after the targets were read, while the second strategy, drain, is not obeyed yet.

    The plant's own control has opened the feed again, which looks like a hand until the heartbeat is not taken.
    """
    first, second = replace(SHUT, serves=shut), replace(DRAIN, serves=TIMES)
    world, vessel = shedding(replace(BOTH, fallbacks=(first, second)))
    vessel.ignores = True
    world.tick(until_s, **values)
    assert acted(world) == ["shut", "drain"] and not world.guard._latch.standing
    vessel.tells = False
    vessel.shed(F_sp=0.03)
    world.tick(1)
    vessel.ignores = False
    world.tick(8)
    return world


def test_after_a_lapse_a_fallback_begins_again_without_what_was_given_up() -> None:
    world = torn({"LIM-FULL": Effect(20.0)}, 22)
    assert acted(world) == ["shut", "drain", "drain"] and world.guard._latch.standing
    assert world.guard.out_of_service == frozenset() and world.vessel.accepted["F.sp"] == 0.0


def test_after_a_lapse_the_strategy_that_another_limit_called_for_is_sent_again_and_not_the_first() -> None:
    world = torn({"LIM-FULL": Effect(60.0)}, 3, T=330.0)
    assert acted(world) == ["shut", "drain", "drain"] and world.guard._latch.standing
    assert world.guard.out_of_service == frozenset() and world.vessel.accepted["F.sp"] == 0.0


def test_what_cannot_be_put_right_is_sent_again_by_the_strategy_that_stands() -> None:
    world, vessel = shedding(serving({"LIM-FULL": Effect(60.0)}))
    world.tick(15, T=330.0)
    world.tick(6, T=305.0, L=8.0)
    assert acted(world) == ["drain", "close"] and world.guard._latch.standing
    vessel.ignores = True
    vessel.shed(F_sp=0.03)
    while len(acted(world)) == 2:
        world.tick(1)
    vessel.ignores = False
    world.tick(8)
    assert acted(world) == ["drain", "close", "close"] and world.guard._latch.standing


def test_a_death_after_a_shed_in_which_nothing_had_acted_leaves_nothing_that_stands() -> None:
    plain = replace(RULES, fallbacks=(CLOSE,))
    world = running(rules=plain)
    for tag in ("F.sp", "X.cmd"):
        world.order(Verb.OUT_OF_SERVICE, tag, reason="maintenance")
    world.tick(1)
    world.tick(3, L=14.0)
    assert acted(world) == [] and "shed" in world.alarms
    again = World(rules=plain, vessel=world.vessel, memory=remembered(world.journal))
    again.tick(3)
    assert not again.guard._latch.standing and "shed" in again.alarms and world.vessel.given_back == 2
    for tag in ("F.sp", "X.cmd"):
        again.order(Verb.IN_SERVICE, tag, reason="done")
    again.tick(15)
    assert acted(again) == ["close"] and again.guard._latch.standing and "shed" not in again.alarms


def test_later_steps_of_a_strategy_that_is_not_obeyed_do_not_outlive_it() -> None:
    machine = replace(MACHINE, transitions=(*MACHINE.transitions, awaited("cool", "shut", "emptying", "L >= 5")))
    cool = Step(machine.transitions[-1], (Command("V.man", 0.5, 0.2),))
    only = replace(CLOSE, actions=replace(CLOSE.actions, then=(cool,)))
    world = running(rules=replace(RULES, machine=machine, fallbacks=(only,)))
    world.vessel.ignores = True
    world.vessel.accepted["F.sp"] = 0.03
    while not world.journal.of(Shed):
        world.tick(1, L=14.0)
    numbered = len(world.sent)
    world.tick(8)
    assert len(world.sent) == numbered and "write:sequence" not in world.alarms
    assert not [e for e, _ in world.journal.events if getattr(e, "source", "") == "cool"]


def test_a_strategy_that_was_given_up_stays_so_over_a_death_in_a_lapse() -> None:
    world, vessel = shedding(serving(TIMES, LATE))
    world.tick(24)
    assert acted(world) == ["drain", "close"] and world.guard._latch.standing
    vessel.shed(F_sp=0.03)
    again = killed(world)
    again.tick(10)
    assert acted(again) == ["drain", "close"] and vessel.accepted["F.sp"] == 0.0
    assert causes(again, "local") and again.guard.out_of_service == frozenset()


@pytest.mark.parametrize("answers", [True, False])
def test_a_strategy_that_gave_way_to_the_plant_s_own_control_is_sent_again(answers: bool) -> None:
    vessel = Sheds()
    waived = replace(BOTH.fallbacks[1], waived={"PRM-FEED": "something must be closed", "PRM-OPEN": "it is short"})
    world = running(rules=replace(BOTH, fallbacks=(BOTH.fallbacks[0], waived)), vessel=vessel)
    vessel.accepts_first = 2  # not the valve
    world.tick(2, L=14.0)
    vessel.shed(F_sp=0.03)  # it looks like a hand, until the heartbeat is not taken
    vessel.silent = not answers
    world.tick(1)
    assert acted(world) == ["drain", "close"]
    given_up = [e.detail for e in world.journal.of(WriteEnded) if e.result is WriteResult.GIVEN_UP]
    assert ("the fallback begins again" in given_up) == (not answers)
    vessel.accepts_first, vessel.silent = 3, False
    world.tick(8)
    assert acted(world) == ["drain", "close", "drain"] and world.guard._latch.standing
    assert vessel.accepted == {"T.sp": 310.0, "F.sp": 0.0, "V.man": 1.0, "X.cmd": 0.0}
