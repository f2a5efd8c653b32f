"""A lapse of the lease: noticed, taken again, and what the plant's own control moved meanwhile is no person's doing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import SequenceLoaded
from homeostat.domain.events.people import AlarmRaised, ModeEntered, PersonHeard, ServiceChanged
from homeostat.domain.events.trips import FallbackActivated, FallbackStands
from homeostat.domain.events.writes import LeaseLost, LeaseTried, WriteIntended
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.snapshot import Snapshot
from tests.guard.test_memory import FALLBACK, remembered
from tests.guard.vessel import ADJUSTED, BEGIN, DRAIN, POUR, RULES, Vessel, World, finding, running, statuses


class Sheds(Vessel):
    """A plant whose heartbeat may not be taken, whose lease may be refused, and whose local control moves the valve."""

    tells = deaf = keeps = void = False

    def beat(self) -> None:
        if self.deaf:
            raise TimeoutError("no answer")
        super().beat()

    def take(self) -> Vessel:
        if self.keeps:
            raise PermissionError("somebody else has it")
        self.void = self.deaf = False
        return super().take()

    def send(self, commands: tuple[Command, ...]) -> Any:
        assert not self.void, "nothing may be written on a lost wire"
        return super().send(commands)

    def shed(self, **moved: float | None) -> None:
        """Local control takes over, and moves the valve back to automatic."""
        self.accepted.update({"V.man": None} | {tag.replace("_", "."): v for tag, v in moved.items()})
        self.void = self.tells
        self.deaf = not self.tells


def lapsing(tells: bool = True, keeps: bool = False, **rest: Any) -> tuple[World, Sheds]:
    """A running world whose valve the guard has opened by a request, before the plant sheds."""
    vessel = Sheds()
    world = running(vessel=vessel, **rest)
    world.ask(actions=ActionSet((Command("V.man", 0.4, 0.2),), "running"))
    world.tick(3)
    assert vessel.accepted["V.man"] == 0.4 and world.guard.out_of_service == frozenset()
    vessel.wire.clear()
    vessel.tells, vessel.keeps = tells, keeps
    return world, vessel


def causes(world: World, alarm: str) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == alarm]


@pytest.mark.parametrize("tells", [True, False])
def test_a_lost_lease_is_one_alarm_and_taken_again_at_once(tells: bool) -> None:
    world, vessel = lapsing(tells)
    leases = vessel.leases
    vessel.shed()
    world.tick()
    assert len(world.journal.of(LeaseLost)) == 1 and vessel.leases == leases + 1
    assert [(e.attempt, e.given) for e in world.journal.of(LeaseTried)] == [(1, True)]
    assert len(causes(world, "heartbeat")) == 1 and "heartbeat" in world.alarms
    world.tick()
    assert "heartbeat" not in world.alarms and world.sent == []
    world.ask(name="r2")
    world.tick(2)
    assert statuses(world, "r2")[-1] == "confirmed"


@pytest.mark.parametrize("tells", [True, False])
def test_what_the_plant_s_own_control_moved_stays_in_service_and_is_told(tells: bool) -> None:
    world, vessel = lapsing(tells)
    vessel.shed()
    world.tick(3)
    assert world.guard.out_of_service == frozenset() and "moved:V.man" not in world.alarms
    assert [c for c in causes(world, "local") if "V.man from 0.4 to automatic" in c and "goes on" in c]


@pytest.mark.parametrize(
    ("moved", "tag"), [({"T_sp": 300.0}, "T.sp"), ({"V_man": 0.7}, "V.man"), ({"X_cmd": 0.0}, "X.cmd")]
)
def test_what_moved_elsewhere_during_a_lapse_was_a_person(moved: dict[str, float], tag: str) -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(2)
    vessel.accepted.update({t.replace("_", "."): v for t, v in moved.items()})
    world.tick()
    vessel.keeps = False
    world.tick(20)
    assert world.guard.out_of_service == {tag} and f"moved:{tag}" in world.alarms


def test_a_person_s_move_while_the_heartbeat_was_taken_is_not_excused_later() -> None:
    world, vessel = lapsing(tells=False)
    vessel.accepted["V.man"] = None
    world.tick()
    vessel.shed()
    world.tick(3)
    assert world.guard.out_of_service == {"V.man"}


def test_a_request_while_the_lease_is_lost_is_refused_with_a_finding_and_a_person_s_start_as_well() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick()
    world.ask(name="r2")
    world.order(Verb.START, "adjust")
    world.tick()
    assert statuses(world, "r2") == ["authorised", "refused"] and finding(world, "r2") == "CHK-LEASE"
    heard = world.journal.of(PersonHeard)[-1]
    assert not heard.done and "the lease is lost" in heard.reason
    assert world.sent == [] and "heartbeat" in world.alarms
    vessel.keeps = False
    world.tick(12)
    assert world.sent == [] and "heartbeat" not in world.alarms


def test_a_request_on_a_wire_that_is_lost_is_given_up_answered_and_read_back() -> None:
    world, vessel = lapsing()
    vessel.hangs = True
    world.ask(name="r2")
    world.tick()
    assert len(world.sent) == 1
    vessel.accepted["T.sp"] = 305.0  # half of it has arrived
    vessel.shed()
    world.tick(3)
    assert statuses(world, "r2")[-1] == "failed" and finding(world, "r2") == "CHK-LEASE"
    assert len(world.sent) == 1 and world.guard.out_of_service == frozenset()
    assert [c for c in causes(world, "write:half") if "T.sp = 305; not F.sp = 0.02" in c]


def test_vain_attempts_at_the_lease_are_journalled_and_become_rare() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(600)
    tried = [(at_s, e.attempt) for e, at_s in world.journal.events if isinstance(e, LeaseTried)]
    assert [n for _, n in tried] == list(range(1, len(tried) + 1)) and 6 <= len(tried) <= 10
    assert [at_s - tried[0][0] for at_s, _ in tried[:5]] == [0.0, 1.0, 2.0, 12.0, 32.0]
    assert len(world.journal.of(LeaseLost)) == 1 and len(causes(world, "heartbeat")) == 1


def test_a_lease_that_somebody_else_takes_again_and_again_is_left_to_them_for_longer_and_longer() -> None:
    world, vessel = lapsing()
    for _ in range(300):
        vessel.shed()
        world.tick()
    assert 4 <= len(world.journal.of(LeaseTried)) <= 9 and len(causes(world, "heartbeat")) <= 9


def test_a_trip_while_the_lease_is_lost_takes_it_and_falls_back_in_its_own_tick() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(20)
    vessel.keeps = False
    world.tick(1, L=14.0)
    assert world.sent == [DRAIN.actions.commands]
    world.tick(5)
    assert world.journal.of(FallbackStands) and world.guard.out_of_service == frozenset()


@pytest.mark.parametrize("tells", [True, False])
def test_a_fallback_in_flight_is_sent_again_on_the_new_wire(tells: bool) -> None:
    world, vessel = lapsing(tells)
    vessel.hangs = True
    world.tick(1, L=14.0)
    vessel.hangs = False
    vessel.shed()
    world.tick(4)
    assert vessel.accepted["V.man"] == 1.0 and world.guard._latch.standing
    assert world.guard.out_of_service == frozenset()
    if tells:
        assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["drain"], "it was not given up"


@pytest.mark.parametrize("tells", [True, False])
def test_a_fallback_that_stood_is_put_right_after_a_shed(tells: bool) -> None:
    world, vessel = lapsing(tells)
    world.tick(5, L=14.0)
    assert world.guard._latch.standing
    vessel.wire.clear()
    vessel.shed()
    world.tick(5)
    assert world.sent == [(Command("V.man", 1.0, 0.2),)] and vessel.accepted["V.man"] == 1.0
    assert world.guard.out_of_service == frozenset() and world.guard._latch.standing


def test_a_mode_that_writes_takes_the_lease_though_it_seems_to_be_held() -> None:
    vessel = Sheds()
    world = running(vessel=vessel)
    leases = vessel.leases
    world.order(Verb.MODE, Mode.APPROVE.value)
    world.tick()
    assert vessel.leases == leases + 1 and world.guard.mode is Mode.APPROVE
    vessel.keeps = True
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick()
    assert world.guard.mode is Mode.APPROVE and "somebody else has it" in world.journal.of(PersonHeard)[-1].reason


def test_a_person_takes_a_lost_lease_by_ordering_a_mode_and_ends_the_attempts_by_observe() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(100)
    vessel.keeps = False
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(2)
    assert world.guard._parts.tenure.held and "heartbeat" not in world.alarms
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(5)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick()
    tried = len(world.journal.of(LeaseTried))
    vessel.keeps = False
    world.tick(60)
    assert len(world.journal.of(LeaseTried)) == tried and "heartbeat" not in world.alarms
    assert not world.guard._parts.tenure.held


def test_a_lease_that_is_lost_as_soon_as_a_person_wants_it_is_tried_for_at_once_however_often_it_was_before() -> None:
    world, vessel = lapsing()
    for _ in range(8):  # each time it lasts for a moment
        vessel.shed()
        world.tick(2)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick(2)
    before = len(world.journal.of(LeaseTried))
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick()
    vessel.shed()
    world.tick(3)
    assert len(world.journal.of(LeaseTried)) == before + 1 and world.guard._parts.tenure.held
    assert "heartbeat" not in world.alarms


MORE = replace(RULES, nominal=(BEGIN, POUR, Step(RULES.machine.transitions[3], (Command("F.sp", 0.0, 0.005),))))


def test_a_recipe_that_the_plant_went_on_with_is_followed_to_where_it_stands() -> None:
    vessel = Sheds()
    world = running(vessel=vessel, rules=MORE)
    vessel.tells = vessel.keeps = True
    vessel.shed(F_sp=0.0, V_man=1.0)  # the next step of the recipe
    world.tick(3, L=9.5)
    vessel.keeps = False
    world.tick(15)
    assert world.guard.out_of_service == frozenset() and world.seen[-1].state == "emptying"
    vessel.wire.clear()
    world.tick(3, L=0.5)
    assert world.seen[-1].state == "rest" and world.sent == [(Command("F.sp", 0.0, 0.005),)]


def test_a_sequence_whose_state_does_not_admit_what_the_plant_did_stops_and_says_so() -> None:
    world = World(vessel=Sheds(), rules=MORE)
    world.tick(4)
    world.tick(4, L=9.5)
    vessel = world.vessel
    assert isinstance(vessel, Sheds) and world.seen[-1].state == "emptying" and vessel.accepted["V.man"] == 1.0
    vessel.wire.clear()
    vessel.tells = True
    vessel.shed()
    world.tick(3)
    assert [c for c in causes(world, "local") if "V.man from 1 to automatic" in c and "has stopped" in c]
    assert world.journal.of(SequenceLoaded)[-1].steps == ()
    world.tick(5, L=0.5)
    assert world.sent == [] and world.guard.out_of_service == frozenset()


def test_in_observe_nobody_takes_a_lease_and_a_shed_is_tracked() -> None:
    vessel = Sheds()
    world = World(mode=Mode.OBSERVE, vessel=vessel, rules=replace(RULES, recipe=Side.PLANT))
    world.tick(3)
    vessel.shed()
    world.tick(5)
    assert world.journal.of(LeaseTried) == [] and world.journal.of(WriteIntended) == [] and vessel.leases == 0


def test_a_wire_that_cannot_say_whether_it_lasts_is_used_as_before() -> None:
    class Odd(Vessel):
        @property
        def void(self) -> bool:
            raise OSError("gone")

    world = running(vessel=Odd())
    world.ask()
    world.tick(2)
    assert statuses(world)[-1] == "confirmed" and world.journal.of(LeaseLost) == []


def test_a_lapse_without_a_reading_lasts_until_there_is_one() -> None:
    world, vessel = lapsing()
    vessel.shed()
    sample = vessel.sample()
    world.seen.append(world.guard.tick(sample.at_s, replace(sample, accepted={})))
    for _ in range(3):
        sample = vessel.sample()
        blind = Snapshot(sample.at_s, {t: v for t, v in sample.values.items() if "." not in t})
        world.seen.append(world.guard.tick(sample.at_s, blind))
    world.ask(name="r2")
    sample = vessel.sample()
    world.seen.append(world.guard.tick(sample.at_s, replace(sample, accepted={})))
    assert "heartbeat" in world.alarms and finding(world, "r2") == "CHK-LEASE"
    world.tick(2)
    assert "heartbeat" not in world.alarms and world.guard.out_of_service == frozenset()
    assert world.journal.of(ServiceChanged) == []


def test_what_is_asked_after_a_lapse_is_as_good_as_before() -> None:
    world, vessel = lapsing()
    vessel.shed()
    world.tick(2)
    world.ask(name="r2")
    world.tick(2)
    assert world.sent == [ADJUSTED.commands] and statuses(world, "r2")[-1] == "confirmed"


def test_a_fallback_that_is_sent_in_observe_takes_a_lost_lease_again() -> None:
    """After a restart nobody may write but what an open intention of a fallback asks for."""
    vessel = Sheds(F_sp=0.03)
    vessel.hangs = vessel.tells = True
    memory = remembered(ModeEntered("closed-loop", ""), FALLBACK)
    world = World(memory=memory, vessel=vessel, goes_on=False)
    world.tick(1)
    assert world.guard.mode is Mode.OBSERVE and len(world.sent) == 1
    vessel.deaf = True
    world.tick(1)
    assert len(world.journal.of(LeaseLost)) == len(world.journal.of(LeaseTried)) == 1
    assert len(world.sent) == 2, "it is sent at once on the new wire"
    vessel.hangs = False
    world.tick(12)
    assert world.guard.mode is Mode.OBSERVE and vessel.accepted["V.man"] == 1.0 and world.journal.of(FallbackStands)
