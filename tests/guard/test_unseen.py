"""A limit that cannot be judged: the first fallback stays, a person is asked, and only what is seen goes on."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.domain.alarm import Alarm
from homeostat.domain.events.trips import FallbackActivated, FallbackIneffective, FallbackStands, Shed, Tripped
from homeostat.domain.mode import Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import Effect
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_memory import Line
from tests.guard.vessel import CLOSE, DRAIN, QUALITIES, RULES, TRIPS, Journal, World, running

NAN = math.nan
LONG = 700
"""Longer than any strategy has to show what it does [s]."""
LEVEL = replace(QUALITIES["L"], noise=0.1, frozen_s=10.0)


def ruled(drain: tuple[str, ...] = ("LIM-FULL",), close: tuple[str, ...] = ("LIM-HOT", "LIM-FULL")) -> GuardRules:
    """Two strategies and what each brings back within 20 s; nothing carries a limit, a level that repeats is bad."""
    serves = [{name: Effect(20.0) for name in names} for names in (drain, close)]
    fallbacks = (replace(DRAIN, serves=serves[0]), replace(CLOSE, serves=serves[1]))
    trips = {name: replace(trip, carrier=None) for name, trip in TRIPS.items()}
    qualities = QUALITIES | {"L": LEVEL, "T": replace(QUALITIES["T"], fastest=None, frozen_s=None)}
    return replace(RULES, fallbacks=fallbacks, qualities=qualities, trips=trips)


def world_of(rules: GuardRules | None = None) -> World:
    return running(rules=rules or ruled())


def blind(rules: GuardRules | None = None) -> World:
    """The level is lost while it is far from its limit, and the fallback stands."""
    world = world_of(rules)
    world.tick(2, L=NAN)
    while not world.journal.of(FallbackStands):
        world.tick(1)
    world.tick(1)
    return world


def acted(world: World) -> list[str]:
    return [e.strategy for e in world.journal.of(FallbackActivated)]


def asked(world: World, name: str = "unseen:LIM-FULL") -> Alarm:
    (alarm,) = [a for a in world.guard.alarms if a.id == name and a.returned_s is None]
    return alarm


def killed(world: World) -> World:
    memory = Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in world.journal.events)
    rules = world.guard._parts.rules
    return World(rules=rules, vessel=world.vessel, memory=memory, record=Journal(world.journal.events))


@pytest.mark.parametrize("how", ["nan", "frozen", "silent"])
def test_a_limit_that_nobody_can_judge_has_one_fallback_act_and_no_other_after_it(how: str) -> None:
    world = blind() if how == "silent" else world_of()
    if how == "frozen":
        world.vessel.wiggle = 0.0
    if how == "silent":
        world.silent(LONG)
    else:
        world.tick(LONG, L=8.0 if how == "frozen" else NAN)
    assert acted(world) == ["drain"]
    assert world.journal.of(FallbackIneffective) == [] and world.journal.of(Shed) == []
    assert world.vessel.given_back == 0 and world.sent == [DRAIN.actions.commands]


def test_a_person_is_asked_and_told_what_stands_still_since_when() -> None:
    world = world_of()
    world.vessel.wiggle = 0.0
    world.tick(40)
    frozen_s = world.seen[-1].snapshot.frozen_s["L"]  # type: ignore[union-attr]
    cause = asked(world).cause
    assert "whether 'drain' helps cannot be seen, a person must look; no other fallback is tried for that" in cause
    assert f"'L' has been exactly 8 L for 10 s: frozen since {frozen_s:g} s" in cause and "LIM-FULL" in cause
    for event in world.journal.of(Tripped):
        assert "frozen since" in event.reason and event.seen is False and math.isnan(event.margin)
    (reason,) = {e.reason for e in world.journal.of(FallbackActivated)}
    assert "frozen since" in reason


def test_nobody_is_asked_any_more_once_the_limit_can_be_judged_and_nothing_else_follows() -> None:
    world = blind()
    asked(world)
    world.tick(100, L=8.0)
    assert "unseen:LIM-FULL" not in world.alarms and "trip:LIM-FULL" not in world.alarms
    assert acted(world) == ["drain"]


def test_a_reset_ends_it() -> None:
    world = blind()
    world.order(Verb.RESET, reason="looked at it")
    world.tick(3)
    assert "unseen:LIM-FULL" not in world.alarms and "latched" not in world.alarms


def test_a_violation_that_comes_to_light_gets_the_time_of_the_strategy_that_serves_it_then_the_next_acts() -> None:
    world = blind()
    world.tick(300)
    world.tick(2, L=13.9)
    assert [e.seen for e in world.journal.of(Tripped)] == [False, True]
    assert "unseen:LIM-FULL" not in world.alarms
    world.tick(18)
    assert acted(world) == ["drain"]
    world.tick(5)
    assert acted(world) == ["drain", "close"]


def test_a_violation_that_comes_to_light_under_one_that_does_not_serve_it_has_the_next_act_at_once() -> None:
    world = blind(ruled(drain=(), close=()))
    world.tick(300)
    world.tick(3, L=13.9)
    assert acted(world) == ["drain", "close"]


def test_another_limit_that_goes_blind_under_a_fallback_calls_for_no_other() -> None:
    world = blind()
    world.tick(LONG, T=NAN)
    assert acted(world) == ["drain"] and {"unseen:LIM-FULL", "unseen:LIM-HOT"} <= world.alarms
    assert {"trip:LIM-FULL", "trip:LIM-HOT"} <= world.alarms and world.journal.of(Shed) == []


def test_another_limit_that_is_seen_to_be_violated_has_the_next_strategy_act() -> None:
    world = blind()
    world.tick(20, T=320.0)
    assert acted(world) == ["drain", "close"]
    assert "whether 'close' helps" in asked(world).cause


def test_what_was_seen_to_be_violated_and_was_lost_then_has_not_improved() -> None:
    world = world_of()
    world.tick(2, L=13.9)
    world.tick(LONG, L=NAN)
    assert acted(world) == ["drain", "close"] and len(world.journal.of(Shed)) == 1
    assert not any(a.startswith("unseen:") for a in world.alarms)


def test_what_was_on_its_way_to_a_trip_when_it_was_lost_was_seen() -> None:
    rules = ruled()
    slow = replace(rules, trips=rules.trips | {"LIM-FULL": replace(rules.trips["LIM-FULL"], cusum=5.0)})
    world = world_of(slow)
    world.tick(2, L=13.5)
    assert acted(world) == []
    world.tick(60, L=NAN)
    assert acted(world) == ["drain", "close"]
    assert [e.seen for e in world.journal.of(Tripped)] == [True]


def test_what_carries_a_limit_judges_on_where_its_own_reading_is_lost() -> None:
    rules = replace(ruled(drain=("LIM-HOT",)), trips=TRIPS)
    kept = world_of(rules)
    kept.tick(LONG, T=NAN)
    assert acted(kept) == ["drain"] and "unseen:LIM-HOT" in kept.alarms
    hot = world_of(rules)
    hot.tick(60, T=NAN, Tx=320.0)
    assert acted(hot) == ["drain", "close"] and hot.journal.of(FallbackIneffective)
    assert all("cannot be judged" not in e.reason for e in hot.journal.of(FallbackIneffective))


def test_a_kill_neither_makes_a_blind_limit_a_violated_one_nor_has_it_come_back() -> None:
    world = blind()
    world.tick(30)
    again = killed(world)
    again.tick(LONG)
    assert acted(again) == ["drain"] and again.journal.of(Shed) == []
    assert {"trip:LIM-FULL", "unseen:LIM-FULL", "latched"} <= again.alarms
    once_more = killed(again)
    once_more.tick(30, L=13.9)
    assert acted(once_more) == ["drain", "close"]


def test_a_kill_keeps_what_was_seen_and_lost() -> None:
    world = world_of()
    world.tick(2, L=13.9)
    world.tick(12, L=NAN)
    again = killed(world)
    again.tick(40)
    assert acted(again) == ["drain", "close"]


def test_an_instrument_that_comes_and_goes_wins_neither_fallbacks_nor_silence() -> None:
    world = blind()
    for _ in range(20):
        world.tick(20, L=8.0)
        world.tick(20, L=NAN)
    assert acted(world) == ["drain"]
    asked(world)
