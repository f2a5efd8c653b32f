"""Ramps that the guard makes: each step waits for the plant; a fallback's goes on whatever the plant says."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest

from homeostat.domain.events.trips import FallbackActivated, FallbackSkipped, FallbackStands, Tripped
from homeostat.domain.mode import Side
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from tests.guard.test_blocking_links import QUICK, Blocked
from tests.guard.vessel import CLOSE, DRAIN, RULES, Vessel, World, running, statuses

GUARDED = replace(RULES, writables={t: replace(r, ramped_by=Side.GUARD) for t, r in RULES.writables.items()})
SLOW = ActionSet((Command("T.sp", 300.0, 0.5),), "running")


def ramping(seconds: int = 0, **rest: object) -> World:
    """A vessel whose temperature setpoint the guard ramps down, for so many seconds."""
    world = running(rules=GUARDED, **rest)
    world.tick(12)
    world.vessel.wire.clear()
    world.ask(actions=SLOW)
    world.tick(seconds)
    return world


def values(world: World, tag: str) -> list[float | None]:
    return [c.value for commands in world.sent for c in commands if c.tag == tag]


@pytest.mark.parametrize("how", ["hangs", "raises", "errors"])
def test_while_the_link_has_not_taken_the_first_value_no_step_follows(how: str) -> None:
    world = ramping()
    setattr(world.vessel, how, True)
    world.tick(20)
    assert values(world, "T.sp") == [310.0] * 3, "one value per attempt"
    assert statuses(world)[-1] == "failed" and "write:request" in world.alarms
    assert world.guard.out_of_service == frozenset()


@pytest.mark.parametrize("how", ["hangs", "raises", "ignores"])
def test_a_ramp_that_the_plant_stops_following_stands_and_is_an_alarm_soon(how: str) -> None:
    world = ramping(6)
    setattr(world.vessel, how, True)
    stood = world.vessel.accepted["T.sp"]
    assert stood is not None and 300.0 < stood < 310.0
    world.vessel.wire.clear()
    world.tick(14)
    assert {v for v in values(world, "T.sp") if v is not None} <= {stood, stood - 0.5}, (
        "never a step ahead of the plant"
    )
    assert "write:request" in world.alarms and statuses(world)[-1] == "failed"
    assert world.guard.out_of_service == frozenset(), "what the guard did itself is nobody else's doing"
    world.vessel.wire.clear()
    world.tick(20)
    assert world.sent == []


class Late(Vessel):
    """A vessel that tells its targets a second late."""

    told: dict[str, float | None] | None = None

    def sample(self) -> Snapshot:
        now, told = super().sample(), self.told
        self.told = dict(self.accepted)
        return now if told is None else replace(now, accepted=told)


def test_a_ramp_waits_for_a_plant_that_tells_late_and_comes_to_its_end() -> None:
    world = ramping(60, vessel=Late())
    steps = [v for v in values(world, "T.sp") if v is not None]
    assert steps[-1] == 300.0 and statuses(world)[-1] == "confirmed"
    assert all(0.0 <= a - b <= 0.5 + 1e-9 for a, b in itertools.pairwise(steps))
    assert world.guard.out_of_service == frozenset()


def test_a_ramp_that_a_trip_stops_half_way_is_nobodys_move() -> None:
    world = ramping(6)
    world.tick(20, L=14.0)
    assert world.guard.latched is not None and "T.sp" not in world.guard.out_of_service
    assert not {a for a in world.alarms if a.startswith("moved")}


def fed(**rest: object) -> World:
    """A vessel with a feed that a fallback has to ramp down."""
    world = ramping(**rest)
    world.tick(25)
    world.ask(world.request("r2", ActionSet((Command("F.sp", 0.03, 0.005),), "running")))
    world.tick(15)
    assert world.vessel.accepted["F.sp"] == 0.03
    world.vessel.wire.clear()
    return world


def test_the_ramp_of_a_fallback_goes_to_its_end_although_the_plant_is_not_heard() -> None:
    world = fed()
    world.silent(40)
    feeds = values(world, "F.sp")
    assert world.guard.latched is not None and feeds[0] == pytest.approx(0.03) and feeds[-1] == 0.0
    assert all(0.0 <= a - b <= 0.005 + 1e-9 for a, b in itertools.pairwise(feeds[:7]) if a and b is not None)
    assert world.vessel.accepted["F.sp"] == 0.0


def test_the_ramp_of_a_fallback_goes_on_although_the_link_never_answers() -> None:
    world = fed()
    world.vessel.silent = True
    world.tick(20, L=14.0)
    assert world.vessel.accepted["F.sp"] == 0.0 and len(world.journal.of(FallbackStands)) == 1


def test_where_the_plant_does_not_follow_the_ramp_of_a_fallback_the_next_strategy_acts_before_its_end() -> None:
    slow = replace(DRAIN, actions=replace(DRAIN.actions, commands=(Command("F.sp", 0.0, 0.0005),)))
    rules = replace(GUARDED, fallbacks=(slow, CLOSE))
    world = running(rules=rules)
    world.tick(12)
    world.ask(actions=ActionSet((Command("F.sp", 0.03, 0.005),), "running"))
    world.tick(15)
    assert world.vessel.accepted["F.sp"] == 0.03
    world.vessel.ignores = True
    world.tick(25, L=14.0)
    tripped = next(at_s for e, at_s in world.journal.events if isinstance(e, Tripped))
    skipped = [(e.strategy, at_s) for e, at_s in world.journal.events if isinstance(e, FallbackSkipped)]
    assert skipped[0][0] == "drain" and skipped[0][1] <= tripped + 15.0, "its ramp takes 60 s"
    assert [e.strategy for e in world.journal.of(FallbackActivated)][:2] == ["drain", "close"]


def test_the_ramp_of_a_fallback_goes_past_a_write_that_hangs_in_the_link() -> None:
    vessel = Blocked()
    world = running(rules=GUARDED, vessel=vessel, settings=QUICK)
    world.tick(12)
    world.ask(actions=ActionSet((Command("F.sp", 0.03, 0.005),), "running"))
    world.tick(15)
    vessel.called.clear()
    vessel.blocked, vessel._most = {"send"}, 1
    world.ask(world.request("r2", SLOW))
    world.tick(2)
    assert vessel.accepted["F.sp"] == 0.03 and vessel.called.count("send") == 1
    world.tick(15, L=14.0)
    assert vessel.accepted["F.sp"] == 0.0 and len(world.journal.of(FallbackStands)) == 1
    vessel.let_go.set()


class Behind(Vessel):
    """A plant that shows a target one sample after it has taken it."""

    def sample(self) -> Snapshot:
        before, shown = dict(self.accepted), getattr(self, "shown", self.accepted)
        self.shown = before
        return replace(super().sample(), accepted=dict(shown))


@pytest.mark.parametrize("kind", [Vessel, Behind])
@pytest.mark.parametrize("seconds", range(1, 13))
def test_a_trip_while_the_guard_ramps_up_takes_no_step_of_its_own_for_a_hand(kind: type, seconds: int) -> None:
    world = World(rules=GUARDED, vessel=kind())
    world.tick(seconds)
    world.tick(40, L=14.0)
    assert len(world.journal.of(FallbackStands)) == 1 and not world.journal.of(FallbackSkipped)
    assert world.guard.out_of_service == frozenset()
    assert world.vessel.accepted["F.sp"] == 0.0 and world.vessel.accepted["X.cmd"] == 0.0
