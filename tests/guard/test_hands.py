"""A person's hand on the plant: while a fallback is in flight, while the guard is dead, and in the middle of a set."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import GuardStarted, StateEntered
from homeostat.domain.events.people import AlarmRaised, ServiceChanged
from homeostat.domain.events.trips import FallbackActivated, FallbackSkipped, FallbackStands
from homeostat.domain.events.writes import Cause, ReadBack, TargetsHeld
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from homeostat.guard.restart.memory import Memory
from homeostat.journal.encode import encode_fields
from tests.guard.test_memory import Line, intended
from tests.guard.vessel import CLOSE, DRAIN, RULES, Journal, Vessel, World, running


def falling(*ignored: str, **rest: Any) -> World:
    """A world whose fallback is in flight: the plant does not take what is sent to the ``ignored`` tags yet."""
    world = running(**rest)
    world.ask(name="before", actions=ActionSet((Command("V.man", 0.3, 0.2),), "running"))
    world.tick(3)
    world.vessel.wire.clear()
    send = world.vessel.send

    def takes(commands: tuple[Command, ...]) -> Any:
        kept = {tag: world.vessel.accepted[tag] for tag in ignored}
        answer = send(commands)
        world.vessel.accepted.update(kept)
        return answer

    world.vessel.send = takes  # type: ignore[method-assign, assignment]
    return world


def causes(world: World, alarm: str) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == alarm]


def test_a_hand_that_leaves_what_was_confirmed_is_respected_while_the_rest_is_still_sent() -> None:
    world = falling("F.sp")
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(2)  # the valve was read open; the feed does not obey yet
    world.vessel.accepted["V.man"] = 0.3  # back to where it was before the fallback
    world.tick(2)
    assert world.guard.out_of_service == {"V.man"} and "moved:V.man" in world.alarms
    world.vessel.send = Vessel.send.__get__(world.vessel)  # type: ignore[method-assign]
    world.tick(8)
    assert world.vessel.accepted == {"T.sp": 310.0, "F.sp": 0.0, "V.man": 0.3, "X.cmd": 0.0}
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["drain"] and world.guard._latch.standing
    assert world.sent[-1] == DRAIN.actions.commands[:2]


@pytest.mark.parametrize("target", [None, 0.1])
def test_a_hand_off_the_way_is_a_person_s(target: float | None) -> None:
    world = falling("V.man")
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick()
    world.vessel.accepted["V.man"] = target
    world.tick(12)
    assert world.guard.out_of_service == {"V.man"} and world.vessel.accepted["V.man"] == target


@pytest.mark.parametrize("target", [0.3, 0.6])
def test_what_is_late_or_on_the_way_is_not_obeyed_yet_and_is_sent_again(target: float) -> None:
    world = falling("V.man")
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick()
    world.vessel.accepted["V.man"] = target
    world.tick(2)
    assert world.guard.out_of_service == frozenset()
    world.vessel.send = Vessel.send.__get__(world.vessel)  # type: ignore[method-assign]
    world.tick(6)
    assert world.vessel.accepted["V.man"] == 1.0 and world.guard._latch.standing


def test_a_row_that_writes_out_of_service_tags_writes_over_a_hand_and_says_so() -> None:
    world = falling("F.sp")
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(2)
    world.vessel.accepted["X.cmd"] = 1.0
    world.tick(6)
    assert world.vessel.accepted["X.cmd"] == 0.0 and "moved:X.cmd" in world.alarms
    assert world.guard.out_of_service == {"X.cmd"}


def test_while_a_limit_is_violated_a_strategy_that_lost_a_tag_has_failed_and_the_next_acts() -> None:
    world = falling("F.sp")
    world.tick(3, L=14.0)
    world.vessel.accepted["V.man"] = 0.5
    world.tick(2)
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["drain", "close"]
    assert [e.strategy for e in world.journal.of(FallbackSkipped)] == ["drain"] and "fallback:drain" in world.alarms
    world.vessel.send = Vessel.send.__get__(world.vessel)  # type: ignore[method-assign]
    world.tick(8)
    assert world.journal.of(FallbackStands)[-1].strategy == "close" and world.vessel.accepted["V.man"] == 0.5
    assert world.guard.out_of_service == {"V.man"}


def test_where_no_other_strategy_is_left_the_rest_of_this_one_is_better_than_a_shed() -> None:
    world = falling("F.sp", rules=replace(RULES, fallbacks=(DRAIN,)))
    world.tick(3, L=14.0)
    world.vessel.accepted["V.man"] = 0.5
    world.tick()
    world.vessel.send = Vessel.send.__get__(world.vessel)  # type: ignore[method-assign]
    world.tick(8)
    assert "shed" not in world.alarms and world.guard._latch.standing and world.vessel.accepted["F.sp"] == 0.0


def test_a_strategy_of_which_everything_was_taken_has_failed() -> None:
    open_ = FallbackStrategy("open", ActionSet((Command("V.man", 1.0, 0.2),), "shut"))
    world = falling("V.man", rules=replace(RULES, fallbacks=(open_, CLOSE)))
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick()
    world.vessel.accepted["V.man"] = 0.1
    world.tick(3)
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == [
        "open",
        "close",
    ] and world.guard._latch.standing
    world = falling("V.man", rules=replace(RULES, fallbacks=(open_,)))
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick()
    world.vessel.accepted["V.man"] = 0.1
    world.tick(3)
    assert "shed" in world.alarms and world.vessel.accepted["V.man"] == 0.1


def test_a_hand_on_a_tag_of_a_request_that_goes_back_to_where_it_was_is_noticed() -> None:
    world = falling("F.sp")
    world.ask()
    world.tick(2)
    world.vessel.accepted["T.sp"] = 310.0
    world.tick(6)
    assert world.guard.out_of_service == {"T.sp"} and world.vessel.accepted["T.sp"] == 310.0


def remembered(journal: Journal) -> Memory:
    """What the journal of a guard that has just died says."""
    return Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e, _ in journal.events)


def dies(world: World, moved: dict[str, float | None], **rest: Any) -> World:
    """The guard dies, targets are moved, and a new guard comes with the journal."""
    world.vessel.accepted.update(moved)
    world.vessel.wire.clear()
    return World(vessel=world.vessel, memory=remembered(world.journal), **rest)


@pytest.mark.parametrize("goes_on", [True, False])
@pytest.mark.parametrize(("tag", "target"), [("F.sp", 0.01), ("T.sp", 300.0), ("X.cmd", 0.0), ("V.man", 0.7)])
def test_a_target_that_was_moved_while_the_guard_was_dead_goes_out_of_service(
    tag: str, target: float, goes_on: bool
) -> None:
    world = dies(running(), {tag: target}, goes_on=goes_on)
    world.tick(3)
    assert world.guard.out_of_service == {tag} and f"moved:{tag}" in world.alarms
    assert [(e.tag, e.person) for e in world.journal.of(ServiceChanged)] == [(tag, "")]
    assert world.vessel.accepted[tag] == target and world.sent == []


def test_what_is_within_the_tolerance_was_moved_by_nobody() -> None:
    world = dies(running(), {"F.sp": 0.0303, "T.sp": 310.04})
    world.tick(3)
    assert world.guard.out_of_service == frozenset() and world.journal.of(ServiceChanged) == []


def test_what_the_plant_s_own_control_did_while_the_guard_was_dead_is_excused_and_told() -> None:
    world = running()
    world.ask(actions=ActionSet((Command("V.man", 0.4, 0.2),), "running"))
    world.tick(3)
    world = dies(world, {"V.man": None})
    world.tick(3)
    assert world.guard.out_of_service == frozenset()
    assert [c for c in causes(world, "local") if "V.man from 0.4 to automatic" in c]
    world.vessel.accepted["V.man"] = 0.4  # the lapse is over: this is a person
    world.tick()
    assert world.guard.out_of_service == {"V.man"}


def test_an_open_intention_explains_what_it_may_have_brought_about_and_nothing_else() -> None:
    before = running()
    before.vessel.hangs = True
    before.ask()
    before.tick()
    world = dies(before, {"T.sp": 305.0})
    world.tick(3)
    assert world.guard.out_of_service == frozenset() and causes(world, "write:half")
    before = running()
    before.vessel.hangs = True
    before.ask()
    before.tick()
    world = dies(before, {"T.sp": 305.0, "F.sp": 0.025})  # on the way, but the plant ramps by itself
    world.tick(3)
    assert world.guard.out_of_service == {"F.sp"}


def test_a_ramp_of_the_guard_may_stand_on_its_way() -> None:
    rules = replace(RULES, writables={t: replace(r, ramped_by=Side.GUARD) for t, r in RULES.writables.items()})
    before = running(rules=rules)
    before.tick(12)
    before.ask(actions=ActionSet((Command("T.sp", 300.0, 0.5),), "running"))
    before.tick(6)
    reached = before.vessel.accepted["T.sp"]
    assert reached is not None and 300.0 < reached < 310.0
    world = dies(before, {}, rules=rules)
    world.tick(3)
    assert world.guard.out_of_service == frozenset()
    world = dies(before, {"T.sp": 311.0}, rules=rules)
    world.tick(3)
    assert world.guard.out_of_service == {"T.sp"}


def test_a_fallback_that_is_sent_again_after_a_death_leaves_a_person_s_tag_alone() -> None:
    before = falling("F.sp", "V.man")
    before.order(Verb.FALL_BACK, reason="smoke")
    before.tick(2)
    before.vessel.send = Vessel.send.__get__(before.vessel)  # type: ignore[method-assign]
    world = dies(before, {"V.man": 0.1})
    world.tick(5)
    assert world.guard.out_of_service == {"V.man"} and world.vessel.accepted["V.man"] == 0.1
    assert world.vessel.accepted["F.sp"] == 0.0 and world.guard._latch.standing


def test_a_fallback_that_stood_is_put_right_after_a_death_in_which_the_plant_shed() -> None:
    before = running()
    before.tick(5, L=14.0)
    assert before.guard._latch.standing
    world = dies(before, {"V.man": None})
    world.tick(5)
    assert world.sent == [(Command("V.man", 1.0, 0.2),)] and world.guard.out_of_service == frozenset()
    world = dies(before, {"V.man": None}, goes_on=False)
    world.tick(20)
    assert world.sent == [] and causes(world, "local") and world.guard.mode is Mode.OBSERVE


def test_the_last_word_on_a_target_is_remembered() -> None:
    found = TargetsHeld({"T.sp": 310.0, "V.man": None})
    wrote = intended(3, Cause.REQUEST, "r1")
    lines: list[Any] = [GuardStarted("vessel", "c", "closed-loop", "guard", False), StateEntered("running"), found]

    def targets(*events: Any) -> dict[str, float | None]:
        return dict(Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e in [*lines, *events]).targets)

    assert targets() == {"T.sp": 310.0, "V.man": None}
    assert targets(wrote, ReadBack(3, ("T.sp",), ("F.sp",))) == {"T.sp": 305.0, "V.man": None}
    assert targets(wrote, ReadBack(3, ("T.sp", "F.sp")), found)["T.sp"] == 310.0


def test_targets_are_journalled_once_as_long_as_nobody_moves_them() -> None:
    world = running()
    world.tick(20)
    told = world.journal.of(TargetsHeld)
    assert [e.targets for e in told] == [{"T.sp": 310.0, "F.sp": 0.0, "V.man": None, "X.cmd": 1.0}]
    world.vessel.accepted["T.sp"] = 300.0
    world.tick(5)
    assert [e.targets for e in world.journal.of(TargetsHeld)[1:]] == [{"T.sp": 300.0}]
