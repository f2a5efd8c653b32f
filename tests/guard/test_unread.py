"""Not seeing is not disobeying: what cannot be read back is sent again, and no other fallback is tried for that."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import FallbackSkipped, FallbackStands, Shed
from homeostat.domain.mode import Verb
from homeostat.domain.snapshot import Snapshot
from tests.guard.test_hands import falling
from tests.guard.test_last_outflow import acted, killed
from tests.guard.vessel import Vessel, World, running


class Mute(Vessel):
    """A vessel of which some targets, or all, are not told."""

    untold: frozenset[str] = frozenset()

    def sample(self) -> Snapshot:
        seen = super().sample()
        told = {tag: target for tag, target in seen.accepted.items() if tag not in self.untold}
        return Snapshot(seen.at_s, seen.values, accepted=told)


def silenced(seconds: int = 120) -> World:
    """A vessel that is too full, and of which nothing more is heard once the fallback is sent."""
    world = running()
    while not world.sent:
        world.tick(1, L=14.0)
    world.silent(seconds)
    return world


def test_a_silent_link_has_the_same_fallback_sent_again_and_again() -> None:
    world = silenced()
    assert set(acted(world)) == {"drain"} and len(acted(world)) > 3
    assert world.journal.of(Shed) == [] and world.journal.of(FallbackSkipped) == [] and world.vessel.given_back == 0
    (alarm,) = [a for a in world.guard.alarms if a.id == "unseen"]
    assert alarm.priority == "critical" and "'drain'" in alarm.cause and "a person must look" in alarm.cause
    assert not {"fallback:drain", "fallback:close", "shed"} & world.alarms


def test_it_is_said_once_and_ends_when_the_plant_is_heard_again() -> None:
    world = silenced()
    assert [e.alarm for e in world.journal.of(AlarmRaised)].count("unseen") == 1
    world.tick(15)
    assert world.journal.of(FallbackStands) and "unseen" not in world.alarms


@pytest.mark.parametrize("untold", [("F.sp",), ("F.sp", "X.cmd", "V.man")])
def test_a_target_that_is_not_told_is_no_sign_that_the_plant_does_not_obey(untold: tuple[str, ...]) -> None:
    vessel = Mute()
    world = running(vessel=vessel)
    vessel.untold = frozenset(untold)
    world.tick(60, L=14.0)
    assert set(acted(world)) == {"drain"} and "unseen" in world.alarms and "shed" not in world.alarms


def test_a_target_that_is_told_to_be_another_is_one() -> None:
    vessel = Mute()
    world = running(vessel=vessel)
    vessel.untold, vessel.ignores = frozenset({"F.sp"}), True
    world.tick(60, L=14.0)
    assert {"fallback:drain", "fallback:close", "shed"} <= world.alarms and "unseen" not in world.alarms


def test_what_is_seen_not_to_be_obeyed_later_ends_that_alarm() -> None:
    world = silenced()
    world.vessel.accepted.update({"X.cmd": 1.0})
    world.vessel.ignores = True
    world.tick(60)
    assert {"fallback:drain", "shed"} <= world.alarms and "unseen" not in world.alarms


def test_a_reset_ends_that_alarm() -> None:
    world = silenced()
    world.vessel.values["L"] = 8.0
    world.tick(20)
    world.order(Verb.RESET, reason="the link is back")
    world.tick(3)
    assert "unseen" not in world.alarms and world.guard.latched is None


def test_over_a_death_the_same_fallback_is_sent_again() -> None:
    world = killed(silenced())
    world.silent(120)
    assert set(acted(world)) == {"drain"} and "unseen" in world.alarms and "shed" not in world.alarms


def test_a_limit_that_only_cannot_be_judged_has_no_fallback_give_way_to_the_next_one() -> None:
    world = falling("F.sp")
    while not world.sent:
        world.tick(1, L=math.nan)
    world.tick(2)
    world.vessel.accepted["V.man"] = 0.5
    world.tick(2)
    assert acted(world) == ["drain"] and world.guard.out_of_service == {"V.man"}
    world.vessel.send = Vessel.send.__get__(world.vessel)  # type: ignore[method-assign]
    world.tick(8)
    assert world.guard._latch.standing and world.vessel.accepted["V.man"] == 0.5
