"""A fallback that stands must help: limits that stay, return slowly, rest, go blind or come on top, kills and modes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.events.trips import FallbackActivated, FallbackIneffective, FallbackStands, LatchReset, Shed
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_memory import Line
from tests.guard.vessel import CLOSE, DRAIN, QUALITIES, RULES, Journal, World, running

TIMES = {"LIM-FULL": Effect(20.0), "LIM-HOT": Effect(30.0)}
SHUT = FallbackStrategy("shut", ActionSet((Command("F.sp", 0.0, 0.005),), "shut"))


def serving(drain: Mapping[str, Effect], close: Mapping[str, Effect] = TIMES) -> GuardRules:
    """Two strategies; readings may stand still, because here they say what they are told to say."""
    qualities = QUALITIES | {"T": replace(QUALITIES["T"], fastest=None, frozen_s=None)}
    fallbacks = (replace(DRAIN, serves=drain), replace(CLOSE, serves=close))
    return replace(RULES, fallbacks=fallbacks, qualities=qualities)


BOTH = serving(TIMES)


def acted(world: World) -> list[str]:
    return [e.strategy for e in world.journal.of(FallbackActivated)]


def full(level: float = 14.0, rules: GuardRules = BOTH) -> World:
    """A vessel that is too full, under a fallback that has just been confirmed."""
    world = running(rules=rules)
    world.tick(2, L=level)
    while not world.journal.of(FallbackStands):
        world.tick(1)
    return world


def test_a_limit_that_stays_violated_has_the_next_strategy_act_and_then_the_plants_own_shed() -> None:
    world = full()
    world.tick(20)
    assert acted(world) == ["drain"] and world.journal.of(FallbackIneffective) == []
    world.tick(1)
    (event,) = world.journal.of(FallbackIneffective)
    assert (event.strategy, event.limit, event.acted) == ("drain", "LIM-FULL", True)
    assert acted(world) == ["drain", "close"] and "fallback:drain" in world.alarms
    assert world.sent == [DRAIN.actions.commands, CLOSE.actions.commands]
    world.tick(24)
    assert [e.strategy for e in world.journal.of(FallbackIneffective)] == ["drain", "close"]
    assert len(world.journal.of(Shed)) == 1 and world.vessel.given_back == 1
    assert {"shed", "latched", "trip:LIM-FULL", "fallback:close"} <= world.alarms
    world.tick(200)
    assert acted(world) == ["drain", "close"] and len(world.journal.of(Shed)) == 1 and world.vessel.given_back == 1
    world.order(Verb.RESET, reason="emptied by hand")
    world.tick(1, L=8.0)
    assert world.journal.of(LatchReset) and not {"shed", "latched", "fallback:drain", "fallback:close"} & world.alarms


def test_what_was_given_up_may_act_again_after_a_reset() -> None:
    world = full()
    world.tick(22)
    world.tick(3, L=8.0)
    world.order(Verb.RESET, reason="emptied by hand")
    world.tick(2)
    world.order(Verb.MODE, "closed-loop")
    world.tick(2)
    world.tick(3, L=14.0)
    assert acted(world) == ["drain", "close", "drain"]


@pytest.mark.parametrize("litres_per_s", [0.05, 0.015])
def test_a_limit_that_comes_back_slowly_is_left_to_the_strategy_that_brings_it_back(litres_per_s: float) -> None:
    world = full()
    rng = np.random.default_rng(1)
    level = 14.0
    for _ in range(300):
        level -= litres_per_s
        world.tick(1, L=level + float(rng.normal(0.0, 0.002)))
    assert acted(world) == ["drain"] and world.journal.of(FallbackIneffective) == []


def test_noise_is_no_improvement_and_one_that_stalls_is_none_any_more() -> None:
    rng = np.random.default_rng(2)
    world = full()
    for _ in range(22):
        world.tick(1, L=14.0 + float(rng.normal(0.0, 0.3)))
    assert acted(world) == ["drain", "close"]
    stalls = full()
    for n in range(22):
        stalls.tick(1, L=14.0 - 0.05 * n)
    assert acted(stalls) == ["drain"]
    stalls.tick(22, L=13.0)
    assert acted(stalls) == ["drain", "close"]


def test_a_limit_that_gets_worse_does_not_improve() -> None:
    world = full(12.8)
    for n in range(22):
        world.tick(1, L=12.8 + 0.05 * n)
    assert acted(world) == ["drain", "close"]


def test_a_limit_may_rest_where_the_tables_say_so_and_no_further() -> None:
    rests = serving({"LIM-FULL": Effect(20.0, rest=2.5)})
    world = full(14.0, rests)
    world.tick(100)
    assert acted(world) == ["drain"]
    deeper = full(14.0, rests)
    deeper.tick(25, L=15.0)
    assert acted(deeper) == ["drain", "close"]


@pytest.mark.parametrize("how", ["nan", "silent"])
def test_what_cannot_be_judged_has_not_improved(how: str) -> None:
    world = full()
    if how == "nan":
        world.tick(120, L=math.nan)
    else:
        world.silent(120)
    assert acted(world)[:2] == ["drain", "close"]
    assert any("cannot be judged" in e.reason for e in world.journal.of(FallbackIneffective))
    if how == "nan":
        assert len(world.journal.of(Shed)) == 1 and "shed" in world.alarms
    else:
        assert set(acted(world)[1:]) == {"close"} and world.journal.of(Shed) == []
        assert "unseen" in world.alarms and "fallback:close" not in world.alarms


def test_a_limit_that_the_strategy_serves_gets_its_time_and_one_that_it_does_not_serve_gets_none() -> None:
    served = full()
    served.tick(12, T=320.0, L=8.0)
    assert "trip:LIM-HOT" in served.alarms and acted(served) == ["drain"]
    served.tick(30)
    assert acted(served) == ["drain", "close"]
    other = full(rules=serving({"LIM-FULL": Effect(20.0)}))
    other.tick(5, T=320.0, L=8.0)
    assert acted(other) == ["drain", "close"] and other.journal.of(FallbackIneffective) == []


def test_a_limit_that_was_brought_back_and_is_violated_again_calls_for_the_next_strategy_at_once() -> None:
    world = full()
    world.tick(5, L=8.0)
    assert "trip:LIM-FULL" not in world.alarms
    world.tick(2, L=14.0)
    assert acted(world) == ["drain", "close"]


def test_the_next_strategy_is_one_that_serves_the_limit_where_there_is_one() -> None:
    shut = replace(SHUT, serves={"LIM-HOT": Effect(30.0)})
    first, last = BOTH.fallbacks
    world = full(rules=replace(BOTH, fallbacks=(first, shut, last)))
    world.tick(22)
    assert acted(world) == ["drain", "close"]
    world.tick(24)
    assert acted(world) == ["drain", "close", "shut"], "what is left is better than nothing"


def test_another_limit_with_nothing_left_is_an_alarm_that_stands_and_what_stands_stays() -> None:
    world = full(rules=serving({"LIM-FULL": Effect(20.0)}, {"LIM-FULL": Effect(500.0)}))
    world.tick(22)
    world.tick(12, T=320.0)
    assert acted(world) == ["drain", "close"] and "fallbacks" in world.alarms
    assert world.journal.of(Shed) == [] and world.vessel.given_back == 0


def test_without_rows_there_is_a_time_too() -> None:
    world = full(rules=RULES)
    world.tick(600)
    assert acted(world) == ["drain"]
    world.tick(1)
    assert acted(world) == ["drain", "close"]


def test_a_clock_that_leaps_ends_no_time_early() -> None:
    world = full()
    for leap_s in (500.0, 3.0):  # the second one says that the first was true
        world.vessel.now_s += leap_s
        world.tick(1)
    world.tick(5)
    assert acted(world) == ["drain"] and world.journal.of(FallbackIneffective) == []


def test_in_observe_it_is_an_alarm_and_nothing_is_written() -> None:
    world = full()
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick(2)
    sent = len(world.sent)
    world.tick(80)
    events = world.journal.of(FallbackIneffective)
    assert [(e.strategy, e.acted) for e in events] == [("drain", False)] and "fallback:drain" in world.alarms
    assert len(world.sent) == sent and world.journal.of(Shed) == []


def killed(world: World, upto: int | None = None) -> World:
    journal = Journal(world.journal.events[:upto])
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in journal.events)
    return World(rules=BOTH, vessel=world.vessel, memory=memory, record=journal)


def test_a_kill_brings_nothing_back_that_was_given_up() -> None:
    world = full()
    world.tick(21)
    assert acted(world) == ["drain", "close"]
    after = next(n for n, (e, _) in enumerate(world.journal.events) if isinstance(e, FallbackIneffective)) + 1
    world.vessel.accepted.update({c.tag: c.value for c in DRAIN.actions.commands})
    again = killed(world, after)
    again.tick(3)
    assert acted(again) == ["drain", "close"]
    again.tick(24)
    assert [e.strategy for e in again.journal.of(FallbackIneffective)] == ["drain", "close"]
    shed = killed(again)
    shed.tick(60)
    assert acted(shed) == ["drain", "close"] and "shed" in shed.alarms


def test_after_a_kill_the_next_strategy_is_not_the_one_that_stands() -> None:
    world = full()
    again = killed(world)
    again.tick(24)
    assert acted(again) == ["drain", "close"]
