"""What a write that has failed, or was given up, leaves behind: what the plant says, an alarm, and nobody's hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.recovery import ActionSet, Command
from tests.guard.test_moves import BACK, late_during_the_second_fallback
from tests.guard.vessel import CLOSE, DRAIN, RULES, Answer, Vessel, World, running

WARM = ActionSet((Command("T.sp", 305.0, 0.5),), "running")


class Clamps(Vessel):
    """A plant that opens its valve to 0.7 and no further."""

    def send(self, commands: tuple[Command, ...]) -> Answer:
        done = super().send(commands)
        opened = self.accepted["V.man"]
        self.accepted["V.man"] = None if opened is None else min(opened, 0.7)
        return done


class Sheds(Vessel):
    """A plant that says when the lease is over."""

    void = False


def causes(world: World, name: str) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == name]


def test_what_the_plant_has_made_of_a_fallback_that_has_failed_is_nobodys_hand() -> None:
    world = running(vessel=Clamps())
    world.tick(20, L=14.0)
    assert "fallback:drain" in world.alarms and world.vessel.accepted["V.man"] == 0.7
    assert world.guard.out_of_service == frozenset()
    world.vessel.accepted["V.man"] = 0.6
    world.tick()
    assert causes(world, "moved:V.man") == ["somebody changed 'V.man' from 0.7 to 0.6"]


@pytest.mark.parametrize(("how", "said"), [
    ("ignores", "r1: the plant does not hold every target"), ("raises", "r1: the control system does not answer"),
])  # fmt: skip
def test_a_write_that_has_failed_as_a_whole_is_one_alarm_with_its_reason(how: str, said: str) -> None:
    world = running()
    setattr(world.vessel, how, True)
    world.ask(actions=WARM)
    world.tick(15)
    assert causes(world, "write:request") == [said] and causes(world, "write:half") == []


@pytest.mark.parametrize(
    ("taken", "half"), [(True, ["r1 was carried out in part: nothing; not T.sp = 305"]), (False, [])]
)
def test_what_the_link_took_and_the_plant_does_not_hold_was_begun(taken: bool, half: list[str]) -> None:
    world = running()
    world.vessel.ignores, world.vessel.silent = True, not taken
    world.ask(actions=WARM)
    world.tick()
    world.order(Verb.MODE, Mode.APPROVE.value)
    world.tick(4)
    assert causes(world, "write:half") == ["r1 was carried out in part: nothing; not T.sp = 305"] * taken


def test_a_fallback_that_was_half_carried_out_has_alarms_of_its_own() -> None:
    world = running()
    world.vessel.accepts_first = 1
    world.tick(20, L=14.0)
    assert "fallback:drain" in world.alarms and causes(world, "write:half") == []


def test_a_hand_on_the_way_to_what_a_request_commands_is_a_hand() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask(actions=WARM)
    world.tick()
    world.vessel.accepted["T.sp"] = 308.0
    world.tick()
    assert world.guard.out_of_service == {"T.sp"}


def test_a_hand_is_not_excused_by_a_lease_that_was_lost_after_it() -> None:
    world = running(vessel=Sheds())
    world.ask(actions=ActionSet((Command("V.man", 0.4, 0.2),), "running"))
    world.tick(3)
    world.vessel.accepted["V.man"] = None  # as local control would have done it, had it been there
    world.tick()
    assert world.guard.out_of_service == {"V.man"}
    world.vessel.void = True  # type: ignore[attr-defined]
    world.silent()
    assert world.guard.out_of_service == {"V.man"}


def test_what_came_late_is_put_back_to_automatic_without_a_rate() -> None:
    world = running(rules=replace(RULES, fallbacks=(CLOSE,)))
    world.vessel.hangs = True
    world.ask(actions=ActionSet((Command("V.man", 0.5, 0.2),), "running"))
    world.tick()
    world.vessel.hangs = False
    world.tick(4, L=14.0)
    world.vessel.accepted["V.man"] = 0.5
    world.tick(3)
    assert world.sent[-1] == (Command("V.man", None, None),) and world.vessel.accepted["V.man"] is None


def test_what_came_late_and_was_moved_since_is_not_put_right() -> None:
    world: Any = late_during_the_second_fallback(obeyed=False)
    world.vessel.accepted["T.sp"] = 299.0
    world.tick()
    assert world.guard.out_of_service == {"T.sp"}
    world.vessel.ignores = False
    world.tick(12)
    assert BACK not in world.sent and world.vessel.accepted["T.sp"] == 299.0
    assert DRAIN.actions.commands in world.sent
