"""A death forgets nothing of how the fallbacks fared: their order, the tried ones, the time that one has to help."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import Armed
from homeostat.domain.events.people import AlarmReturned
from homeostat.domain.events.trips import (
    EffectFollowed,
    FallbackActivated,
    FallbackIneffective,
    FallbackSkipped,
    FallbackStands,
    Latched,
    LatchReset,
    Shed,
    TripLifted,
    TripLiftEnded,
    Tripped,
)
from homeostat.domain.events.writes import Cause, LeaseLost
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.observation import Arm, Correction, FallBack
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import Command, Effect
from homeostat.guard.fallback.trial import Passed, Trial
from homeostat.guard.restart.memory import Memory
from homeostat.guard.writing.flight import PUT_RIGHT
from tests.guard.test_effect import BOTH, TIMES, full, serving
from tests.guard.test_memory import Line, intended, remembered
from tests.guard.vessel import CLOSE, DRAIN, RULES, Journal, World, running

THIRD = replace(CLOSE, name="third")
THREE = replace(RULES, fallbacks=(DRAIN, CLOSE, THIRD))


def killed(world: World, rules: GuardRules = BOTH, dead_s: float = 0.0, **rest: Any) -> World:
    """The guard dies and comes back after ``dead_s``; its journal goes on, and the plant with it."""
    memory = remembered(*(e for e, _ in world.journal.events))
    world.vessel.now_s += dead_s
    journal = Journal(list(world.journal.events))
    return World(rules=rules, vessel=world.vessel, memory=memory, record=journal, **rest)


def acted(world: World) -> list[str]:
    return [e.strategy for e in world.journal.of(FallbackActivated)]


def given_up_s(world: World) -> list[float]:
    return [at_s for e, at_s in world.journal.events if isinstance(e, FallbackIneffective)]


def armed(*names: str, rules: GuardRules = THREE) -> World:
    world = running(rules=rules)
    world.guard.mailbox.put(Arm(names))
    world.tick()
    return world


def test_the_order_that_recovery_armed_outlives_a_death() -> None:
    world = killed(armed("third", "close"), THREE)
    world.tick(2)
    world.guard.mailbox.put(FallBack("smoke"))
    world.tick(2)
    assert acted(world) == ["third"]


@pytest.mark.parametrize("dies", [False, True])
@pytest.mark.parametrize("swapped", [False, True])
def test_a_time_to_act_by_arms_no_strategy_in_this_life_nor_the_next(swapped: bool, dies: bool) -> None:
    """What serves the violated limit acts, wherever it stands in the tables."""
    order = (replace(CLOSE, serves={"LIM-FULL": Effect(60.0)}), replace(DRAIN, serves={"LIM-HOT": Effect(60.0)}))
    rules = replace(RULES, fallbacks=order[::-1] if swapped else order)
    world = running(rules=rules)
    world.guard.mailbox.put(Arm((), 200.0))
    world.tick()
    world = killed(world, rules) if dies else world
    world.tick(5, L=14.0)
    assert acted(world)[:1] == ["close"]


@pytest.mark.parametrize("dies", [False, True])
def test_an_order_that_no_twin_has_tried_counts_until_a_limit_trips_that_another_one_serves(dies: bool) -> None:
    rules = replace(RULES, fallbacks=(replace(DRAIN, serves={"LIM-FULL": Effect(60.0)}), CLOSE))
    for level, first in ((14.0, "drain"), (8.0, "close")):
        world = running(rules=rules)
        world.guard.mailbox.put(Arm(("close", "drain"), 12.0, tried=False))
        world.tick()
        world = killed(world, rules) if dies else world
        world.tick(4, L=level)
        assert acted(world) == (["drain"] if level > 12.0 else [])
        world.tick(5)
        assert acted(world)[0] == first, "the time to act by has passed"


def test_a_reset_brings_the_order_of_the_tables_back_in_this_life_and_the_next() -> None:
    world = armed("third", "close")
    world.guard.mailbox.put(FallBack("smoke"))
    world.tick(3)
    world.order(Verb.RESET, reason="seen")
    world.tick(2)
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(2)
    world = killed(world, THREE)
    world.tick(2)
    world.guard.mailbox.put(FallBack("smoke again"))
    world.tick(2)
    assert acted(world) == ["third", "drain"]


def test_the_order_outlives_a_death_in_the_fallback_and_so_do_those_that_were_tried() -> None:
    world = armed("third", "close")
    world.vessel.ignores = True
    world.guard.mailbox.put(FallBack("smoke"))
    while acted(world) != ["third", "close"]:
        world.tick()
    world = killed(world, THREE)
    world.tick()
    assert acted(world) == ["third", "close", "close"], "what was being sent is sent again"
    while len(acted(world)) < 4:
        world.tick()
    assert acted(world)[3] == "drain"
    while "shed" not in world.alarms:
        world.tick()
    assert len(acted(world)) == 4, "the one that was not obeyed before the death is not tried before the others again"
    world.tick(12)
    assert acted(world)[4] == "third", "a new round has the armed order"


@pytest.mark.parametrize("deaths", [1, 5, 18])
def test_a_death_makes_the_time_in_which_a_fallback_must_help_no_longer(deaths: int) -> None:
    alive = full()
    alive.tick(30)
    world = full()
    for _ in range(deaths):
        world.tick(max(18 // deaths, 1))
        world = killed(world)
    world.tick(30 - deaths * max(18 // deaths, 1))
    assert given_up_s(world)[0] <= given_up_s(alive)[0] and acted(world)[:2] == ["drain", "close"]
    assert given_up_s(world)[0] >= given_up_s(alive)[0] - 1.0, "nor much shorter"


def test_the_time_that_the_guard_was_dead_counts_as_a_tick_at_most() -> None:
    world = full()
    world.tick(5)
    world = killed(world, dead_s=500.0)
    world.tick(9)
    assert given_up_s(world) == []
    world.tick(6)
    assert len(given_up_s(world)) == 1


def test_a_margin_that_rises_slowly_is_seen_to_rise_over_a_death() -> None:
    world = full()
    for n in range(17):
        world.tick(1, L=14.0 - 0.01 * n)
    world = killed(world)
    for n in range(17, 24):
        world.tick(1, L=14.0 - 0.01 * n)
    assert acted(world) == ["drain"] and given_up_s(world) == []


def test_a_limit_that_has_come_back_before_a_death_has_no_second_time_after_it() -> None:
    world = full()
    world.tick(5, L=8.0)
    assert "trip:LIM-FULL" not in world.alarms
    world = killed(world)
    world.tick(2)
    world.tick(3, L=14.0)
    assert acted(world) == ["drain", "close"]


def test_a_limit_that_comes_back_while_the_guard_is_dead_has_no_second_time_either() -> None:
    world = full()
    world.tick(3)
    world.vessel.values["L"] = 8.0
    world = killed(world)
    world.tick(3)
    world.tick(3, L=14.0)
    assert acted(world) == ["drain", "close"]


def test_a_violated_limit_does_not_look_as_if_it_had_come_back_because_the_guard_died() -> None:
    world = full(12.3)
    world.tick(3)
    world = killed(world)
    world.tick(8)
    assert acted(world) == ["drain"] and "trip:LIM-FULL" in world.alarms
    assert [e.limit for e in world.journal.of(Tripped)] == ["LIM-FULL"] * 2


def test_a_limit_that_no_strategy_has_answered_yet_is_answered_at_once_after_a_death() -> None:
    rules = serving({"LIM-FULL": Effect(20.0)})
    world = running(rules=rules)
    world.tick(1, L=14.0)
    while acted(world) != ["drain"]:
        world.tick()
    world.vessel.values.update(T=350.0)
    while "LIM-HOT" not in [e.limit for e in world.journal.of(Tripped)]:
        world.tick()
    events = world.journal.events
    upto = next(n for n, (e, _) in enumerate(events) if isinstance(e, Tripped) and e.limit == "LIM-HOT") + 1
    del events[upto:]
    world.vessel.accepted.update({c.tag: c.value for c in DRAIN.actions.commands})
    world = killed(world, rules)
    world.tick(4)
    assert acted(world) == ["drain", "close"]


def test_what_a_fallback_has_answered_is_not_answered_again_after_a_death() -> None:
    rules = serving({"LIM-FULL": Effect(500.0)}, {"LIM-FULL": Effect(500.0)})
    rules = replace(rules, fallbacks=(*rules.fallbacks, replace(THIRD, serves={"LIM-FULL": Effect(500.0)})))
    world = full(rules=rules)
    world.tick(14, T=320.0)
    assert acted(world) == ["drain", "close"], "the next one answers the second limit"
    world = killed(world, rules)
    world.tick(20)
    assert acted(world) == ["drain", "close"] and "trip:LIM-HOT" in world.alarms


def test_the_journal_of_a_version_that_did_not_follow_the_time_is_gone_on_with() -> None:
    world = full()
    world.tick(5)
    world.journal.events = [(e, at_s) for e, at_s in world.journal.events if e.kind != "effect-followed"]
    world = killed(world)
    world.tick(26)
    assert acted(world) == ["drain", "close"]


def lifted(dead_s: float, before_s: int = 20) -> tuple[World, World]:
    """A world whose trip is lifted for some seconds, and the same after a death."""
    world = running()
    world.guard.mailbox.put(Correction(({"T": 8.0},)))
    for n in range(8):
        world.tick(1, T=305.0 + min(n, 1) * 8.0 * (n + 1) / 8.0)
    world.tick(before_s, T=318.0)
    again = killed(world, RULES, dead_s)
    again.guard.mailbox.put(Correction(({"T": 8.0},)))
    return world, again


def test_the_time_for_which_a_trip_was_lifted_is_used_up_also_after_a_death() -> None:
    world, again = lifted(dead_s=0.0)
    (told,) = world.journal.of(TripLifted)
    again.tick(2)
    while not [e for e in again.journal.of(Tripped) if e.limit == "LIM-HOT"]:
        again.tick()
        assert again.vessel.now_s <= told.until_s + 12.0
    assert [e.until_s for e in again.journal.of(TripLifted)[1:]] == [pytest.approx(told.until_s, abs=1.0)]
    assert again.vessel.now_s == pytest.approx(told.until_s, abs=2.0)


def test_time_in_which_nothing_was_lifted_is_not_used_up() -> None:
    world, again = lifted(dead_s=0.0)
    world.tick(15, T=305.0)
    ended = [e for e, _ in world.journal.events if e.kind == "trip-lift-ended"]
    assert [e.limit for e in ended] == ["LIM-HOT"]  # type: ignore[attr-defined]
    again = killed(world, RULES, dead_s=300.0)
    again.guard.mailbox.put(Correction(({"T": 8.0},)))
    again.tick(6)
    again.tick(20, T=318.0)
    assert again.journal.of(Latched) == [] and len(again.journal.of(TripLifted)) == 2


def test_ranks_tries_and_times_are_read_from_the_journal_as_they_were_written() -> None:
    world = full()
    world.tick(5)
    trial = remembered(*(e for e, _ in world.journal.events)).trial
    assert trial.acted == "drain" and trial.stands and trial.violated == {"LIM-FULL"} == trial.answered
    assert trial.effects["LIM-FULL"].passed_s >= 2.0
    world.vessel.accepted["X.cmd"] = 1.0
    skipped = remembered(
        FallbackActivated("drain", (Command("X.cmd", 0.0, None),), "hot"), FallbackSkipped("drain", "not obeyed"),
        FallbackSkipped("close", "void"), FallbackActivated("third", (), "hot"), FallbackStands("third"),
    ).trial  # fmt: skip
    assert skipped.tried == {"drain", "close", "third"} and skipped.stands
    assert TIMES["LIM-FULL"].acts_within_s == 20.0


def trial(*events: Any) -> Trial:
    return remembered(*events).trial


def sent(source: str, number: int = 4, cause: Cause = Cause.FALLBACK) -> Any:
    return intended(number, cause, source)


HOT, FULL = (Tripped(name, -1.0, "1", "violated", True) for name in ("LIM-HOT", "LIM-FULL"))
FOLLOWED = EffectFollowed("drain", "LIM-FULL", 9.0, 4.0, (5.0, 5.0, 10.0, 30.0, -5.0, 5.0, -10.0))
STANDS = FallbackStands("drain")
BACK = AlarmReturned("trip:LIM-FULL")


def test_who_acts_first_answers_what_is_violated_and_who_acts_next_what_it_was_chosen_against() -> None:
    first = trial(HOT, AlarmReturned("trip:LIM-HOT"), FULL, sent("drain"))
    assert first.violated == first.answered == {"LIM-FULL"} and first.acted == "drain"
    second = trial(FULL, sent("drain"), HOT, sent("close", 5))
    assert second.answered == {"LIM-FULL"} and second.violated == {"LIM-FULL", "LIM-HOT"}
    chosen = trial(FULL, sent("drain"), HOT, sent("close", 5), FallbackActivated("close", (), "hot", ("LIM-HOT",)))
    assert chosen.answered == {"LIM-FULL", "LIM-HOT"}
    assert trial(FULL, Latched("full")).answered == {"LIM-FULL"}, "nothing has passed its checks"
    assert trial(FULL, sent("drain"), HOT, Latched("full")).answered == {"LIM-FULL"}
    before = [Line("fallback-activated", {"strategy": name, "reason": "hot"}) for name in ("drain", "close")]
    old = Memory.of((before[0], Line("tripped", {"limit": "A"}), before[1])).trial
    assert old.answered == {"A"}, "an older journal does not say it"


def test_what_is_sent_for_another_reason_is_no_turn_of_a_fallback() -> None:
    for event in (sent(PUT_RIGHT), sent("r1", cause=Cause.REQUEST)):
        found = trial(FULL, sent("drain", 3), STANDS, FOLLOWED, event)
        assert (found.acted, found.tried, found.stands) == ("drain", {"drain"}, True) and found.effects


def test_whoever_has_a_turn_again_begins_another_round() -> None:
    skip, close = FallbackSkipped("drain", "void"), FallbackSkipped("close", "void")
    assert trial(sent("drain"), skip, close).tried == {"drain", "close"}
    assert trial(sent("drain"), skip, close, sent("close", 5)).tried == {"close"}
    assert trial(sent("drain"), sent("close", 5), sent("drain", 6)).tried == {"drain"}
    assert trial(sent("drain"), sent("close", 5), Shed("nothing helps")).tried == frozenset()


def test_what_comes_back_is_violated_no_more_and_has_come_back_under_what_stands() -> None:
    standing = trial(FULL, HOT, sent("drain"), STANDS, FOLLOWED, BACK)
    assert standing.violated == standing.answered == {"LIM-HOT"} and standing.returned == {"LIM-FULL"}
    assert standing.effects == {}
    assert trial(FULL, sent("drain"), BACK).returned == frozenset()
    other = trial(FULL, sent("drain"), STANDS, FOLLOWED, AlarmReturned("LIM-FULL"), AlarmReturned("trip:LIM-HOT"))
    assert other.violated == {"LIM-FULL"} and "LIM-FULL" not in other.returned and "LIM-FULL" in other.effects


@pytest.mark.parametrize(
    ("event", "kept"),
    [
        (FallbackIneffective("drain", "LIM-FULL", "no", True), False),
        (FallbackIneffective("drain", "LIM-FULL", "no", False), True),
        (FallbackIneffective("drain", "LIM-HOT", "no", True), True),
        (LeaseLost("gone"), False), (Shed("nothing helps"), False), (sent("close", 5), False),
        (LatchReset(("Ada",), "seen", "shut"), False), (FallbackStands("close"), True),
    ],
)  # fmt: skip
def test_how_far_a_time_has_come_counts_as_long_as_the_strategy_stands(event: Any, kept: bool) -> None:
    before = trial(FULL, sent("drain"), STANDS, FOLLOWED)
    assert before.effects == {"LIM-FULL": Passed(9.0, 4.0, FOLLOWED.sums)}
    assert ("LIM-FULL" in trial(FULL, sent("drain"), STANDS, FOLLOWED, event).effects) is kept


def test_what_stands_is_what_acted_last() -> None:
    assert not trial(sent("drain"), FallbackStands("close")).stands
    assert trial(sent("drain"), STANDS).stands and not trial(sent("drain"), STANDS, sent("drain", 5)).stands
    assert not trial(sent("drain"), STANDS, Shed("nothing helps")).stands
    assert trial(FULL, sent("drain"), STANDS, BACK, LeaseLost("gone")).returned == frozenset()


def test_a_reset_forgets_everything_but_what_is_violated_and_what_was_lifted() -> None:
    lift = TripLifted("LIM-HOT", "Tx <= 311.5", 90.0)
    found = trial(Armed(("close",), None), FULL, lift, sent("drain"), STANDS, LatchReset(("Ada",), "seen", "shut"))
    assert found == Trial(violated=frozenset({"LIM-FULL"}), lifting={"LIM-HOT": 90.0})


def test_a_trip_has_been_lifted_for_as_long_as_the_journal_says_and_goes_on_where_it_says_no_end() -> None:
    begun = trial(TripLifted("LIM-HOT", "Tx", 90.0))
    assert [begun.lifted_s("LIM-HOT", 60.0, now_s) for now_s in (30.0, 50.0, 90.0, 500.0)] == [0.0, 20.0, 60.0, 60.0]
    ended = trial(TripLifted("LIM-HOT", "Tx", 90.0), TripLiftEnded("LIM-HOT", 12.0))
    assert ended.lifted_s("LIM-HOT", 60.0, 500.0) == 12.0 and ended.lifted_s("LIM-HOT", 10.0, 500.0) == 10.0
    assert ended.lifted_s("LIM-FULL", 60.0, 500.0) == 0.0
    again = trial(TripLifted("LIM-HOT", "Tx", 90.0), TripLiftEnded("LIM-HOT", 12.0), TripLifted("LIM-HOT", "Tx", 200.0))
    assert again.lifted_s("LIM-HOT", 60.0, 150.0) == 12.0 and again.lifted_s("LIM-HOT", 60.0, 160.0) == 20.0
    two = trial(TripLifted("A", "x", 90.0), TripLifted("B", "x", 80.0), TripLiftEnded("A", 1.0))
    assert two.lifting == {"B": 80.0} and two.lifted == {"A": 1.0}


def test_a_fallback_that_acts_before_the_plant_was_read_after_a_death_is_sent_until_it_stands() -> None:
    again = killed(full(rules=THREE), THREE)
    vessel = again.vessel
    vessel.ignores = True
    vessel.accepted["F.sp"] = 0.03
    vessel.values["T"] = 330.0
    for _ in range(2):
        blind = replace(vessel.sample(), accepted={})
        again.seen.append(again.guard.tick(blind.at_s, blind))
    assert acted(again) == ["drain", "drain"]
    again.tick(1)
    assert not again.guard._latch.standing
    vessel.ignores = False
    again.tick(4)
    assert acted(again) == ["drain", "drain"] and vessel.accepted["F.sp"] == 0.0
    assert again.journal.of(FallbackStands)[-1].strategy == "drain" and again.guard._latch.standing
