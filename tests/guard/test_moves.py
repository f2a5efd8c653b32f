"""Moves: what others change is respected; what of ours arrives late is put right while a fallback is latched."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.events.people import ServiceChanged
from homeostat.domain.events.trips import FallbackStands
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from tests.guard.vessel import CLOSE, DRAIN, RULES, World, running

LATE = ActionSet((Command("T.sp", 305.0, 0.5), Command("V.man", 0.5, 0.2)), "running")
FLUSH = FallbackStrategy("flush", ActionSet((Command("V.man", 0.7, 0.2),), "shut"))
BACK = (Command("T.sp", 310.0, 0.5),)
"""What puts a late T.sp right."""


def order(world: World, verb: Verb, subject: str = "") -> None:
    world.order(verb, str(subject), reason="a test")
    world.tick()


def cause(world: World, name: str) -> str:
    return next(a.cause for a in world.guard.alarms if a.id == name)


def hung(**rest: Any) -> World:
    """A world in which a request hangs on its way to the plant."""
    world = running(**rest)
    world.vessel.hangs = True
    world.ask(actions=LATE)
    world.tick()
    world.vessel.hangs = False
    world.vessel.wire.clear()
    return world


@pytest.mark.parametrize("mode", [Mode.CLOSED_LOOP, Mode.OBSERVE])
@pytest.mark.parametrize("recipe", Side)
def test_a_move_that_leads_to_no_state_of_the_recipe_is_somebody_s(mode: Mode, recipe: Side) -> None:
    world = World(mode=mode, rules=replace(RULES, recipe=recipe))
    world.tick(4)
    world.vessel.accepted["T.sp"] = 300.0
    world.tick()
    assert world.guard.out_of_service == {"T.sp"} and "moved:T.sp" in world.alarms
    assert cause(world, "moved:T.sp") == "somebody changed 'T.sp' from 310 to 300"


def test_however_often_somebody_moves_a_tag_only_what_moved_last_is_kept() -> None:
    world = running()
    for number in range(20):
        world.vessel.accepted["T.sp"] = 300.0 + number
        order(world, Verb.IN_SERVICE, "T.sp")
        world.tick()
    assert len([e for e in world.journal.of(ServiceChanged) if not e.in_service]) == 20
    assert len(world.guard._moves._hands) <= 1  # memory of a guard that runs for years


@pytest.mark.parametrize(("moved_s", "noticed"), [(14.0, False), (15.0, True)])
def test_for_10_s_after_the_lease_went_back_the_plant_s_own_control_moves_its_targets(
    moved_s: float, noticed: bool
) -> None:
    world = running()
    world.ask(actions=ActionSet((Command("V.man", 0.4, 0.2),), "running"))
    world.tick(3)
    order(world, Verb.MODE, Mode.OBSERVE)  # at 8 s
    world.tick(int(moved_s) - 6)
    world.vessel.accepted["V.man"] = None  # back to automatic
    world.tick(3)
    assert world.guard.out_of_service == ({"V.man"} if noticed else frozenset())


@pytest.mark.parametrize("after_s", [1, 5, 9, 20])
def test_a_hand_right_after_the_lease_went_back_is_a_hand(after_s: int) -> None:
    world = running()
    order(world, Verb.MODE, Mode.OBSERVE)
    world.tick(after_s)
    world.vessel.accepted["V.man"] = 0.4
    world.tick()
    assert world.guard.out_of_service == {"V.man"}
    order(world, Verb.MODE, Mode.CLOSED_LOOP)
    world.ask(actions=ActionSet((Command("V.man", 0.8, 0.2),), "running"))
    world.tick(3)
    assert world.vessel.accepted["V.man"] == 0.4


def test_who_has_the_lease_again_notices_a_move_at_once() -> None:
    world = running()
    order(world, Verb.MODE, Mode.OBSERVE)
    order(world, Verb.MODE, Mode.CLOSED_LOOP)
    world.vessel.accepted["V.man"] = 0.4
    world.tick()
    assert world.guard.out_of_service == {"V.man"}


def test_a_late_write_is_said_and_put_right_while_a_fallback_is_latched() -> None:
    world = hung()
    world.tick(4, L=14.0)
    world.vessel.accepted["T.sp"] = 305.0
    world.tick(2)
    assert world.sent == [DRAIN.actions.commands, BACK] and world.guard.out_of_service == frozenset()
    alarm = next(a for a in world.guard.alarms if a.id == "late:T.sp")
    assert alarm.cause == "a write that was given up has moved 'T.sp' after all" and alarm.priority is Priority.HIGH
    assert alarm.raised_s == alarm.returned_s == 10.0  # over already: it stands until somebody has seen it


def test_a_late_write_counts_as_somebody_s_where_nothing_is_latched() -> None:
    world = hung()
    order(world, Verb.MODE, Mode.APPROVE)  # overtakes it
    world.tick(2)
    world.vessel.accepted["T.sp"] = 305.0
    world.tick(3)
    assert world.guard.out_of_service == {"T.sp"} and "moved:T.sp" in world.alarms and world.sent == []
    assert "late:T.sp" not in {a.id for a in world.guard.alarms}


@pytest.mark.parametrize(("target", "noticed"), [(305.0, False), (300.0, True)])
def test_what_was_given_up_may_arrive_by_the_next_reading_and_nothing_else_may(target: float, noticed: bool) -> None:
    world = hung()
    order(world, Verb.MODE, Mode.APPROVE)  # overtakes it
    world.vessel.accepted["T.sp"] = target
    world.tick(3)
    assert world.guard.out_of_service == ({"T.sp"} if noticed else frozenset())
    assert world.alarms == ({"moved:T.sp"} if noticed else set())


def test_a_late_write_to_a_tag_that_a_person_has_is_left_alone() -> None:
    world = hung()
    order(world, Verb.OUT_OF_SERVICE, "T.sp")
    world.tick(4, L=14.0)
    world.vessel.accepted["T.sp"] = 305.0
    world.tick(4)
    assert world.sent == [DRAIN.actions.commands] and world.guard.out_of_service == {"T.sp"}


def test_while_a_fallback_is_sent_its_own_tags_move_as_they_like_and_the_others_are_somebody_s() -> None:
    world = running()
    world.vessel.ignores = True
    world.tick(1, L=14.0)
    world.vessel.accepted.update({"V.man": 0.4, "T.sp": 300.0})
    world.tick()
    assert world.guard.out_of_service == {"T.sp"}
    world.vessel.ignores = False
    world.tick(4)
    assert world.vessel.accepted["V.man"] == 1.0 and world.vessel.accepted["T.sp"] == 300.0


def late_during_the_second_fallback(obeyed: bool) -> World:
    """A hung request, a fallback that stands, and another on its way when the request arrives after all."""
    world = hung(rules=replace(RULES, fallbacks=(DRAIN, FLUSH)))
    world.tick(4, L=14.0)
    world.vessel.ignores = True
    world.tick(6, T=330.0)
    assert world.sent == [DRAIN.actions.commands, FLUSH.actions.commands]
    world.vessel.accepted["T.sp"] = 305.0
    world.vessel.ignores = not obeyed
    world.tick()
    assert "late:T.sp" in {a.id for a in world.guard.alarms}
    return world


def test_a_late_write_is_put_right_once_the_fallback_under_way_stands() -> None:
    world = late_during_the_second_fallback(obeyed=True)
    assert world.sent[-1] == FLUSH.actions.commands
    world.tick(6)
    assert world.sent[-1] == BACK and world.vessel.accepted["T.sp"] == 310.0
    assert not {name for name in world.alarms if name.startswith("guard:")}


def test_what_was_not_put_right_before_a_reset_is_not_put_right_after_it() -> None:
    world = late_during_the_second_fallback(obeyed=False)
    for _ in range(20):
        if "shed" in world.alarms:
            break
        world.tick()
    order(world, Verb.RESET)
    assert world.guard.latched is None
    world.vessel.ignores = False
    world.tick(12, L=8.0, T=305.0)
    world.vessel.wire.clear()
    order(world, Verb.MODE, Mode.CLOSED_LOOP)
    order(world, Verb.FALL_BACK)
    stood = len(world.journal.of(FallbackStands))
    world.tick(6)
    assert len(world.journal.of(FallbackStands)) == stood + 1 and BACK not in world.sent


def test_a_hand_in_the_tick_of_a_trip_is_somebody_s_though_the_fallback_s_state_admits_it() -> None:
    world = running(rules=replace(RULES, fallbacks=(CLOSE,)))
    world.vessel.accepted["V.man"] = 0.3
    world.tick(1, L=14.0)
    assert world.seen[-1].state == "shut" and world.sent == [CLOSE.actions.commands]
    assert world.guard.out_of_service == {"V.man"}


def test_where_a_fallback_stands_and_the_lease_is_given_back_a_hand_is_noticed() -> None:
    world = running()
    world.tick(4, L=14.0)
    assert world.journal.of(FallbackStands)
    order(world, Verb.MODE, Mode.OBSERVE)
    world.tick(12)
    world.vessel.accepted["V.man"] = None  # as the plant's own control may have done before
    world.tick(2)
    assert world.guard.out_of_service == {"V.man"}
