"""What was sent for a violated limit is not taken back for another: what stands is kept, and a person must act."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.events.trips import FallbackIneffective, Shed
from homeostat.domain.mode import Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_effect import acted, full
from tests.guard.test_memory import Line
from tests.guard.vessel import MACHINE, QUALITIES, RULES, Journal, World

FULL, HOT = {"LIM-FULL": Effect(20.0)}, {"LIM-HOT": Effect(20.0)}


def strategy(name: str, opening: float | None, serves: dict[str, Effect], feed: bool = True) -> FallbackStrategy:
    """One that closes the feed, and brings the outlet to ``opening``; None leaves it."""
    shut = (Command("X.cmd", 0.0, None),) if feed else ()
    outlet = () if opening is None else (Command("V.man", opening, 0.2),)
    return FallbackStrategy(name, ActionSet((*shut, Command("F.sp", 0.0, 0.005), *outlet), "shut"), serves=serves)


EMPTY, STOP = strategy("empty", 1.0, FULL), strategy("stop", 0.0, HOT)


def ruled(*fallbacks: FallbackStrategy) -> GuardRules:
    """A vessel whose outlet one strategy opens and another one closes; a reading may stand still, as it is told to."""
    qualities = QUALITIES | {"T": replace(QUALITIES["T"], fastest=None, frozen_s=None)}
    return replace(RULES, machine=MACHINE, fallbacks=fallbacks or (EMPTY, STOP), qualities=qualities)


def standing(*fallbacks: FallbackStrategy) -> World:
    """A vessel that is too full, under the strategy that stands first."""
    return full(rules=ruled(*fallbacks))


def killed(world: World) -> World:
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in world.journal.events)
    rules = world.guard._parts.rules
    return World(rules=rules, vessel=world.vessel, memory=memory, record=Journal(world.journal.events))


def test_a_fallback_for_another_limit_does_not_close_the_last_outflow() -> None:
    world = standing()
    world.tick(200)
    assert acted(world) == ["empty"] and world.vessel.accepted["V.man"] == 1.0
    assert (
        world.journal.of(Shed) == [] and world.vessel.given_back == 0 and world.vessel.beats[-1] == world.vessel.now_s
    )
    assert [e.acted for e in world.journal.of(FallbackIneffective)] == [False]
    (kept,) = [a for a in world.guard.alarms if a.id == "kept:LIM-FULL"]
    assert kept.priority == "critical" and "'stop'" in kept.cause and "a person must act" in kept.cause


def test_the_alarm_ends_with_the_violation_and_after_a_reset_everything_may_act_again() -> None:
    world = standing()
    world.tick(25)
    assert {"kept:LIM-FULL", "fallback:empty"} <= world.alarms
    world.tick(3, L=8.0)
    assert "kept:LIM-FULL" not in world.alarms
    world.order(Verb.RESET, reason="emptied by hand")
    world.tick(2)
    world.order(Verb.MODE, "closed-loop")
    world.tick(2)
    world.tick(15, T=330.0)
    assert acted(world) == ["empty", "stop"]


def test_a_reset_ends_the_alarm() -> None:
    world = standing()
    world.tick(25)
    world.tick(1, L=8.0)
    world.order(Verb.RESET, reason="emptied by hand")
    world.tick(3)
    assert not [name for name in world.alarms if name.startswith(("kept", "fallback"))]


def test_every_strategy_that_serves_the_limit_has_its_turn_before() -> None:
    world = standing(EMPTY, STOP, strategy("spill", 0.5, FULL))
    world.tick(100)
    assert acted(world) == ["empty", "spill"] and "kept:LIM-FULL" in world.alarms
    assert [e.acted for e in world.journal.of(FallbackIneffective)] == [True, False]


def test_one_that_sets_nothing_else_than_what_serves_the_limit_can_do_no_harm() -> None:
    world = standing(EMPTY, strategy("close", None, HOT))
    world.tick(25)
    assert acted(world) == ["empty", "close"]


def test_one_that_writes_what_no_strategy_for_the_limit_does_is_not_known_to_do_no_harm() -> None:
    isolate = FallbackStrategy("isolate", ActionSet((Command("X.cmd", 0.0, None),), "shut"), serves=HOT)
    world = standing(strategy("empty", 1.0, FULL, feed=False), isolate)
    world.tick(25)
    assert acted(world) == ["empty"] and "kept:LIM-FULL" in world.alarms


def test_where_the_tables_say_nothing_of_the_limit_their_order_counts() -> None:
    world = standing(replace(EMPTY, serves={}), STOP)
    world.tick(605)
    assert acted(world) == ["empty", "stop"]


def test_a_limit_that_is_violated_as_well_gets_the_strategy_that_the_tables_have_for_it() -> None:
    world = standing()
    world.tick(12, T=330.0)
    assert acted(world) == ["empty", "stop"]


def test_a_limit_for_which_there_is_none_takes_nothing_back() -> None:
    world = full(rules=ruled(EMPTY, replace(STOP, serves={})))
    world.tick(12, T=330.0)
    assert acted(world) == ["empty"] and "fallbacks" in world.alarms


def test_one_that_is_not_obeyed_has_no_other_one_close_the_outflow() -> None:
    world = World(rules=ruled())
    world.tick(4)
    world.vessel.accepts_first = 1
    world.tick(60, L=14.0)
    assert set(acted(world)) == {"empty"} and "shed" in world.alarms
    assert not any(Command("V.man", 0.0, 0.2) in commands for commands in world.sent)
    world.vessel.accepts_first = 100
    world.tick(30)
    assert world.vessel.accepted["V.man"] == 1.0 and "shed" not in world.alarms


def test_of_one_that_was_refused_as_a_whole_there_is_nothing_to_take_back() -> None:
    world = World(rules=ruled())
    world.tick(4)
    world.vessel.accepted["F.sp"], world.vessel.ignores = 0.03, True
    world.tick(60, L=14.0)
    assert acted(world)[:2] == ["empty", "stop"]


@pytest.mark.parametrize("after_s", [0, 1, 60])
def test_over_a_death_the_outflow_stays_open(after_s: int) -> None:
    world = standing()
    world.tick(21 + after_s)
    assert "kept:LIM-FULL" in world.alarms
    world = killed(world)
    world.tick(100)
    assert acted(world) == ["empty"] and world.vessel.accepted["V.man"] == 1.0 and "shed" not in world.alarms
    assert "kept:LIM-FULL" in world.alarms


def test_over_a_death_in_the_middle_of_the_round_the_outflow_stays_open() -> None:
    world = standing(EMPTY, STOP, strategy("spill", 0.5, FULL))
    world.tick(21)
    assert acted(world) == ["empty", "spill"]
    world = killed(world)
    world.tick(100)
    assert acted(world)[-1] == "spill" and "stop" not in acted(world)


def test_in_observe_it_is_an_alarm_and_nothing_is_kept_for_another() -> None:
    world = standing()
    world.order(Verb.MODE, "observe", reason="looking")
    world.tick(30)
    assert acted(world) == ["empty"] and "kept:LIM-FULL" not in world.alarms and "fallback:empty" in world.alarms
