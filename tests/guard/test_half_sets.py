"""A set of commands of which only a part was written when something overtook it: an alarm says which."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.recovery import ActionSet, Command
from tests.guard.vessel import ADJUSTED, POUR, World, running, statuses


def half(world: World) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "write:half"]


@pytest.mark.parametrize("who", ["mode", "fallback", "trip", "hand", "service"])
def test_a_request_of_which_a_part_was_written_is_an_alarm_that_says_which(who: str) -> None:
    world = running()
    world.vessel.accepts_first = 1
    world.ask(actions=ActionSet((Command("T.sp", 305.0, 0.5), Command("F.sp", 0.02, 0.005)), "running"))
    world.tick()
    world.vessel.accepts_first = 100
    match who:
        case "mode":
            world.order(Verb.MODE, Mode.APPROVE.value)
        case "fallback":
            world.order(Verb.FALL_BACK, reason="smoke")
        case "hand":
            world.vessel.accepted["F.sp"] = 0.05
        case "service":
            world.vessel.ignores = True
            world.order(Verb.OUT_OF_SERVICE, "F.sp", reason="repair")
    world.tick(6, L=14.0 if who == "trip" else 8.0)
    assert half(world) == ["r1 was carried out in part: T.sp = 305; not F.sp = 0.02"]
    assert statuses(world)[-1] in ("withdrawn", "failed")


def test_a_step_and_a_start_that_were_half_written_are_alarms() -> None:
    world = running()
    world.ask(actions=ActionSet(ADJUSTED.commands, "running", (POUR,)), path=("adjust", "empty"))
    world.tick(3)
    world.vessel.accepts_first = 1
    world.tick(1, L=9.5)
    world.order(Verb.MODE, Mode.APPROVE.value)
    world.tick(8)  # it is owed, and sent again in the new mode
    assert set(half(world)) == {"empty was carried out in part: F.sp = 0; not V.man = 1"}
    world = running()
    world.tick(4, L=14.0)
    world.order(Verb.RESET, reason="seen")
    world.tick(1, L=4.0)
    world.order(Verb.MODE, Mode.APPROVE.value)
    world.tick()
    world.vessel.accepts_first = 2
    world.order(Verb.START, "restart")
    world.tick()
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(4)
    assert half(world) == ["Ada was carried out in part: T.sp = 310, F.sp = 0; not X.cmd = 1, V.man = automatic"]


def test_a_set_that_was_written_whole_or_not_at_all_is_no_half_one() -> None:
    for arrives in (0, 100):
        world = running()
        world.vessel.accepts_first = arrives
        world.vessel.silent = True
        world.ask()
        world.tick()
        world.vessel.silent, world.vessel.accepts_first = False, 100
        world.order(Verb.MODE, Mode.APPROVE.value)
        world.tick(4)
        assert half(world) == []


def test_what_a_fallback_overwrote_before_it_was_read_is_said_to_be_unknown() -> None:
    world = running()
    world.vessel.accepts_first = 1
    world.ask(actions=ActionSet((Command("T.sp", 305.0, 0.5), Command("F.sp", 0.02, 0.005)), "running"))
    world.tick()
    world.vessel.accepts_first = 100
    world.order(Verb.FALL_BACK, reason="smoke")
    sample = replace(world.vessel.sample(), accepted={})
    world.seen.append(world.guard.tick(sample.at_s, sample))
    world.tick(4)
    assert half(world) == ["r1 was carried out in part: T.sp = 305; overwritten unread F.sp = 0.02"]


def test_what_a_fallback_wrote_is_no_part_of_the_set_that_it_has_overtaken() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask(actions=ActionSet((Command("T.sp", 305.0, 0.5), Command("V.man", 1.0, 0.2)), "running"))
    world.tick()
    world.vessel.hangs = False
    world.tick(5, L=14.0)
    assert world.vessel.accepted["V.man"] == 1.0 and half(world) == []
