"""A lease that is lost, and a hand on the plant, while the guard ramps a target."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import FallbackActivated, FallbackStands
from homeostat.domain.events.writes import Cause, LeaseLost, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.observation import FallBack
from homeostat.domain.recovery import ActionSet, Command
from tests.guard.test_lapse import Sheds
from tests.guard.test_ramps import GUARDED, SLOW, values
from tests.guard.vessel import CLOSE, DRAIN, World, finding, running, statuses

FEED = ActionSet((Command("F.sp", 0.03, 0.005),), "running")
SLOWLY = replace(DRAIN, actions=ActionSet((Command("X.cmd", 0.0, None), Command("F.sp", 0.0, 0.002)), "shut"))
RULES = replace(GUARDED, fallbacks=(SLOWLY, CLOSE))
"""The feed is ramped down in 15 s by the first strategy."""


def fed(tells: bool = True, **rest: Any) -> tuple[World, Sheds]:
    """A vessel that is fed with 0.03 L/s, and ramps of the guard."""
    vessel = Sheds()
    world = running(rules=rest.pop("rules", RULES), vessel=vessel, **rest)
    world.tick(15)
    assert vessel.accepted["F.sp"] == 0.03
    vessel.wire.clear()
    vessel.tells = tells
    return world, vessel


def causes(world: World, alarm: str) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == alarm]


@pytest.mark.parametrize("tells", [True, False])
def test_the_ramp_of_a_fallback_goes_on_from_where_it_is_when_the_lease_is_lost_and_taken_again(tells: bool) -> None:
    world, vessel = fed(tells)
    world.tick(5, L=14.0)
    reached = vessel.accepted["F.sp"]
    assert reached is not None and 0.0 < reached < 0.03
    vessel.shed()
    world.tick(25)
    feeds = [v for v in values(world, "F.sp") if v is not None]
    assert feeds[-1] == 0.0 and max(abs(a - b) for a, b in itertools.pairwise(feeds)) <= 0.002 + 1e-9
    assert [e.strategy for e in world.journal.of(FallbackStands)] == ["drain"]
    assert len(world.journal.of(LeaseLost)) == 1 and world.guard.out_of_service == frozenset()
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["drain"]
    assert WriteResult.GIVEN_UP not in [e.result for e in world.journal.of(WriteEnded)], "the link had taken it"


def test_the_attempt_that_was_lost_with_its_wire_has_an_end_in_the_journal_and_the_next_one_a_number() -> None:
    world, vessel = fed()
    vessel.hangs = True
    world.tick(2, L=14.0)
    vessel.hangs = False
    vessel.shed()
    world.tick(2)
    attempts = [e.attempt for e in world.journal.of(WriteIntended) if e.cause is Cause.FALLBACK]
    ends = [(e.attempt, e.result, e.detail) for e in world.journal.of(WriteEnded) if e.write == 2]
    assert attempts == [1, 2]
    assert ends == [(1, WriteResult.GIVEN_UP, "the wire was lost"), (2, WriteResult.ACCEPTED, "")]


@pytest.mark.parametrize("tells", [True, False])
def test_the_ramp_of_a_request_stands_where_the_lease_was_lost_and_that_is_nobodys_move(tells: bool) -> None:
    world, vessel = fed(tells)
    world.ask(actions=SLOW)
    world.tick(6)
    reached = vessel.accepted["T.sp"]
    assert reached is not None and 300.0 < reached < 310.0
    vessel.shed()
    vessel.wire.clear()
    world.tick(6)
    now = vessel.accepted["T.sp"]
    assert now is not None and reached - 0.5 <= now <= reached and values(world, "T.sp") in ([], [now])
    assert statuses(world)[-1] == "failed" and finding(world) == "CHK-LEASE"
    assert world.guard.out_of_service == frozenset() and not causes(world, "moved:T.sp")
    world.ask(name="r2", actions=SLOW)
    vessel.wire.clear()
    world.tick(25)
    assert values(world, "T.sp")[0] == now and vessel.accepted["T.sp"] == 300.0
    assert statuses(world, "r2")[-1] == "confirmed"


def test_nothing_is_ramped_while_nobody_has_the_lease() -> None:
    world, vessel = fed()
    world.tick(5, L=14.0)
    vessel.keeps = True
    vessel.shed()
    vessel.wire.clear()
    world.tick(8)
    assert world.sent == []
    vessel.keeps = False
    world.tick(40)
    assert vessel.accepted["F.sp"] == 0.0 and world.guard.out_of_service == frozenset()
    feeds = [v for v in values(world, "F.sp") if v is not None]
    assert all(abs(a - b) <= 0.005 + 1e-9 for a, b in itertools.pairwise(feeds))


@pytest.mark.parametrize("target", [0.05, None])
def test_a_hand_off_the_way_of_a_fallback_s_ramp_has_the_tag_and_the_ramp_of_the_rest_goes_on(
    target: float | None,
) -> None:
    row = replace(DRAIN, actions=ActionSet((Command("T.sp", 300.0, 0.5), Command("F.sp", 0.0, 0.002)), "running"))
    world, vessel = fed(rules=replace(GUARDED, fallbacks=(row,)))
    world.guard.mailbox.put(FallBack("smoke"))
    world.tick(5)
    vessel.accepted["F.sp"] = target
    vessel.wire.clear()
    world.tick(25)
    assert world.guard.out_of_service == {"F.sp"} and vessel.accepted["F.sp"] == target
    assert set(values(world, "F.sp")) <= {world.vessel.accepted["F.sp"]}, "not one step more"
    assert vessel.accepted["T.sp"] == 300.0 and len(world.journal.of(FallbackStands)) == 1


def test_a_hand_back_on_the_way_of_a_fallback_s_ramp_is_not_obeyed_yet_and_the_ramp_comes_to_its_end() -> None:
    world, vessel = fed()
    world.tick(8, L=14.0)
    vessel.accepted["F.sp"] = 0.03
    world.tick(25)
    assert world.guard.out_of_service == frozenset() and vessel.accepted["F.sp"] == 0.0


def test_a_hand_on_a_ramp_that_writes_out_of_service_tags_is_said_and_the_ramp_comes_to_its_end_all_the_same() -> None:
    forced = replace(SLOWLY, forced=frozenset({"F.sp"}))
    world, vessel = fed(rules=replace(GUARDED, fallbacks=(forced, CLOSE)))
    world.guard.mailbox.put(FallBack("smoke"))
    world.tick(5)
    vessel.accepted["F.sp"] = 0.05
    world.tick(40)
    assert "moved:F.sp" in world.alarms and world.guard.out_of_service == {"F.sp"}
    assert vessel.accepted["F.sp"] == 0.0 and [e.strategy for e in world.journal.of(FallbackStands)] == ["drain"]


@pytest.mark.parametrize("arrives", [True, False])
def test_a_step_to_which_the_link_said_no_is_the_guard_s_own_and_the_ramp_goes_on(arrives: bool) -> None:
    world, vessel = fed()
    world.ask(actions=SLOW)
    world.tick(6)
    send = vessel.send

    def says_no(commands: tuple[Command, ...]) -> Any:
        if arrives:
            send(commands)
        raise TimeoutError("no answer in time")

    vessel.send = says_no  # type: ignore[method-assign]
    world.tick(1)
    vessel.send = send  # type: ignore[method-assign]
    world.tick(25)
    assert world.guard.out_of_service == frozenset() and "moved:T.sp" not in world.alarms
    assert vessel.accepted["T.sp"] == 300.0 and statuses(world)[-1] == "confirmed"
    assert len([e for e in world.journal.of(WriteIntended) if e.source == "r1"]) == 1
