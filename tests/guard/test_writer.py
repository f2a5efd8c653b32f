"""The one way to the plant: intention before write, read-back, numbered retries, and a link that does what it likes."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest

from homeostat.domain.events.guard import StepTaken
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.events.writes import Cause, ReadBack, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.mode import Mode, Side, Verb
from homeostat.domain.recovery import ActionSet, Command
from homeostat.guard.writing.flight import same
from tests.guard.vessel import ADJUSTED, DRAIN, ROUTE, RULES, World, finding, running, statuses

pytestmark = pytest.mark.quick


def ended(world: World) -> list[WriteResult]:
    return [e.result for e in world.journal.of(WriteEnded)]


def test_the_intention_is_on_the_disk_before_anything_is_sent() -> None:
    world = running()
    order: list[str] = []
    send, sync = world.vessel.send, world.journal.sync
    world.vessel.send = lambda commands: (order.append("send"), send(commands))[1]  # type: ignore[method-assign]
    world.journal.sync = lambda: (order.append(world.journal.kinds[-1]), sync())[1]  # type: ignore[method-assign]
    world.ask()
    world.tick()
    assert order == ["write-intended", "send"]


def test_an_intention_says_everything_that_a_restart_needs() -> None:
    world = running()
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick()
    intended = world.journal.of(WriteIntended)[-1]
    assert (intended.write, intended.attempt, intended.cause, intended.source) == (2, 1, Cause.REQUEST, "r1")
    assert (intended.commands, intended.digest, intended.state) == (ROUTE.commands, ROUTE.digest, "running")
    assert [(s.transition, s.commands) for s in intended.steps] == [("empty", ROUTE.then[0].commands)]


def test_order_rate_and_automatic_reach_the_plant_as_they_are() -> None:
    actions = ActionSet(
        (Command("V.man", None, None), Command("F.sp", 0.02, 0.001), Command("T.sp", 300, 0.5)), "running"
    )
    world = running()
    world.ask(actions=actions)
    world.tick(2)
    assert world.sent == [actions.commands] and statuses(world)[-1] == "confirmed"


def test_what_the_plant_does_not_hold_is_tried_again_under_a_number_of_its_own() -> None:
    world = running()
    world.vessel.ignores = True
    world.ask()
    world.tick(12)
    attempts = [(e.write, e.attempt) for e in world.journal.of(WriteIntended)][1:]
    assert attempts == [(2, 1), (2, 2), (2, 3)]
    assert len(world.sent) == 3
    read = [e for e in world.journal.of(ReadBack) if e.write == 2]
    assert [e.deviating for e in read] == [("T.sp", "F.sp")] * 3
    assert statuses(world)[-1] == "failed" and finding(world) == "CHK-OBEYED"
    assert "write:request" in world.alarms


def test_a_half_set_is_said_and_tried_again() -> None:
    world = running()
    world.vessel.accepts_first = 1
    world.ask()
    world.tick(4)
    assert world.journal.of(ReadBack)[-1].confirmed == ("T.sp",)
    assert world.journal.of(ReadBack)[-1].deviating == ("F.sp",)
    world.vessel.accepts_first = 9
    world.tick(3)
    assert statuses(world)[-1] == "confirmed" and "write:request" not in world.alarms


@pytest.mark.parametrize("how", ["raises", "errors"])
def test_a_failed_attempt_is_read_back_and_tried_again(how: str) -> None:
    world = running()
    setattr(world.vessel, how, True)
    world.vessel.accepts_first = 0
    world.ask()
    world.tick()
    setattr(world.vessel, how, False)
    world.vessel.accepts_first = 9
    world.tick(3)
    assert ended(world)[1:] == [WriteResult.FAILED, WriteResult.ACCEPTED]
    assert [e.deviating for e in world.journal.of(ReadBack)[1:]] == [("T.sp", "F.sp"), ()]
    assert statuses(world)[-1] == "confirmed"


def test_a_failed_attempt_that_arrived_all_the_same_is_confirmed_by_reading() -> None:
    world = running()
    world.vessel.errors = True  # the link says no, and the plant has taken it
    world.ask()
    world.tick(2)
    assert len(world.sent) == 1 and statuses(world)[-1] == "confirmed"


def test_a_hung_attempt_is_given_up_after_its_time_and_tried_again() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask()
    world.tick(3)
    assert len(world.sent) == 1
    world.vessel.hangs = False
    world.tick(3)
    assert ended(world)[1:] == [WriteResult.TIMED_OUT, WriteResult.ACCEPTED]
    assert len(world.sent) == 2 and statuses(world)[-1] == "confirmed"


def test_a_hung_attempt_that_is_read_to_stand_is_confirmed() -> None:
    world = running()
    world.vessel.silent = True
    world.ask()
    world.tick(2)
    assert len(world.sent) == 1 and statuses(world)[-1] == "confirmed"


@pytest.mark.parametrize("ticket", [None, 7, "odd"])
def test_a_link_that_gives_no_ticket_has_failed_and_is_read_back(ticket: object) -> None:
    class Odd:
        @property
        def done(self) -> bool:
            raise OSError("gone")

    world = running()
    answers = Odd() if ticket == "odd" else ticket
    world.vessel.send = lambda commands: answers  # type: ignore[method-assign, assignment, return-value]
    world.ask()
    world.tick(8)
    assert ended(world)[1:] == [WriteResult.FAILED] * 3
    assert statuses(world)[-1] == "failed"


def test_at_most_one_write_is_in_flight() -> None:
    world = running()
    world.vessel.silent = world.vessel.ignores = True
    world.ask(name="a")
    world.ask(name="b")
    world.tick(2)
    assert len(world.sent) == 1 and statuses(world, "b") == ["authorised"]


def test_without_a_reading_after_it_a_request_is_not_tried_again_but_read_when_one_comes() -> None:
    world = running()
    world.vessel.ignores = True
    world.ask()
    world.tick()
    world.silent(5)
    assert len(world.sent) == 1 and statuses(world)[-1] == "failed"
    assert [e for e in world.journal.of(ReadBack) if e.write == 2] == []
    world.vessel.accepted.update({"T.sp": 305.0, "F.sp": 0.02})  # it was carried out late
    world.tick()
    assert [e.confirmed for e in world.journal.of(ReadBack) if e.write == 2] == [("T.sp", "F.sp")]
    world.tick(2)
    assert world.guard.out_of_service == frozenset()


def test_a_retry_is_checked_on_the_reading_of_its_own_time() -> None:
    world = running()
    world.vessel.raises = True
    world.ask(actions=ActionSet((Command("F.sp", 0.05, 0.005),), "running"))
    world.tick()
    world.tick(1, L=11.5)  # PRM-FEED does not hold any more
    assert len(world.sent) == 1 and statuses(world)[-1] == "failed"
    assert "L <= 11" in world.seen[-1].answers[-1].reason


def test_a_retry_is_not_sent_half_way_to_a_trip_nor_to_a_tag_that_a_person_has_taken() -> None:
    world = running()
    world.vessel.ignores = True
    world.ask()
    world.tick()
    world.vessel.accepted["T.sp"] = 300.0
    world.tick()
    assert world.guard.out_of_service == {"T.sp"}
    world.tick(5)
    assert len(world.sent) == 1 and statuses(world)[-1] == "failed"
    world = running()
    world.vessel.raises = True
    world.ask(actions=ActionSet((Command("T.sp", 305.0, 0.5),), "running"))
    world.tick()
    world.tick(1, L=12.4)
    assert len(world.sent) == 1 and statuses(world)[-1] == "failed"
    assert "LIM-FULL" in world.seen[-1].answers[-1].reason


def test_a_trip_comes_before_a_retry_of_the_same_tick() -> None:
    world = running()
    world.vessel.raises = True
    world.ask()
    world.tick()
    world.vessel.raises = False
    world.tick(1, L=14.0)
    assert world.sent == [ADJUSTED.commands, DRAIN.actions.commands]


def test_a_step_of_the_sequence_stays_due_when_its_write_failed() -> None:
    world = World()
    world.vessel.raises = True
    world.tick(6)
    assert world.seen[-1].state == "waiting" and len(world.sent) == 3
    assert world.journal.of(StepTaken) == []
    world.vessel.raises, world.vessel.hangs = False, True
    sent = len(world.sent)
    while len(world.sent) == sent:
        world.tick()
    world.tick()
    assert "write:sequence" in world.alarms, "a new attempt is under way, and nothing is known of it"
    world.vessel.hangs = False
    world.tick(10)
    assert world.seen[-1].state == "running" and len(world.sent) == 5
    assert len(world.journal.of(StepTaken)) == 1 and "write:sequence" not in world.alarms


def test_a_step_that_the_link_took_and_the_plant_did_not_is_sent_until_it_holds() -> None:
    world = World()
    world.vessel.ignores = True
    world.tick(15)
    assert world.seen[-1].state == "running" and len(world.sent) == 3 and "write:sequence" in world.alarms
    world.vessel.ignores = False
    world.tick(10)
    assert len(world.sent) == 4 and world.vessel.accepted["F.sp"] == 0.03
    assert len(world.journal.of(StepTaken)) == 1 and "write:sequence" not in world.alarms
    world.tick(30)
    assert len(world.sent) == 4


def test_a_mode_change_during_a_step_does_not_stop_the_sequence_for_ever() -> None:
    world = World()
    world.vessel.hangs = True
    world.tick()
    world.order(Verb.MODE, Mode.APPROVE.value)
    world.tick()
    world.vessel.hangs = False
    world.tick(6)
    assert world.seen[-1].state == "running" and world.guard.mode is Mode.APPROVE


def test_an_overtaken_write_that_arrives_after_the_fallback_is_put_right() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask(actions=ActionSet((Command("T.sp", 305.0, 0.5), Command("V.man", 0.5, 0.2)), "running"))
    world.tick()
    world.vessel.hangs = False
    world.tick(4, L=14.0)
    assert world.sent[1:] == [DRAIN.actions.commands]
    world.vessel.accepted.update({"T.sp": 305.0, "V.man": 0.5})
    world.tick(3)
    assert world.sent[2:] == [(Command("T.sp", 310.0, 0.5), Command("V.man", 1.0, 0.2))]
    assert world.vessel.accepted["T.sp"] == 310.0 and world.guard.out_of_service == frozenset()
    world.vessel.accepted["T.sp"] = 305.0  # it cannot arrive twice: this is a person
    world.tick(2)
    assert len(world.sent) == 3 and world.guard.out_of_service == {"T.sp"}


def test_a_late_write_that_cannot_be_put_right_has_the_fallback_act_again() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask()
    world.tick()
    world.vessel.hangs = False
    world.tick(4, L=14.0)
    world.vessel.accepted["F.sp"] = 0.02
    world.vessel.ignores = True
    world.tick(14)
    world.vessel.ignores = False
    world.tick(8)
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["drain", "drain", "close"]
    assert world.vessel.accepted["F.sp"] == 0.0 and world.guard._latch.standing


GUARDED = replace(RULES, writables={t: replace(r, ramped_by=Side.GUARD) for t, r in RULES.writables.items()})
SLOW = ActionSet((Command("T.sp", 300.0, 0.5),), "running")


def guarded() -> World:
    world = running(rules=GUARDED)
    world.tick(12)
    world.vessel.wire.clear()
    return world


def test_a_ramp_of_the_guard_is_one_intention_and_goes_to_its_end() -> None:
    world = guarded()
    world.ask(actions=SLOW)
    world.tick(25)
    values = [c.value for commands in world.sent for c in commands]
    assert values[0] == 310.0 and values[-1] == 300.0 and len(values) == 21
    assert all(a - b == pytest.approx(0.5) for a, b in itertools.pairwise(values))
    assert all(c.rate is None for commands in world.sent for c in commands)
    assert len([e for e in world.journal.of(WriteIntended) if e.source == "r1"]) == 1
    assert statuses(world)[-1] == "confirmed" and world.guard.out_of_service == frozenset()


@pytest.mark.parametrize("what", ["trip", "mode", "person"])
def test_a_ramp_of_the_guard_stops_for_a_trip_a_mode_and_a_person(what: str) -> None:
    world = guarded()
    world.ask(actions=SLOW)
    world.tick(8)
    reached = world.vessel.accepted["T.sp"]
    assert reached is not None and 300.0 < reached < 310.0
    if what == "mode":
        world.order(Verb.MODE, Mode.OBSERVE.value)
    if what == "person":
        world.vessel.accepted["T.sp"] = 311.0
    world.tick(25, L=14.0 if what == "trip" else 8.0)
    now = world.vessel.accepted["T.sp"]
    assert now is not None
    assert now == 311.0 if what == "person" else now >= reached - 0.5
    if what == "person":
        assert world.guard.out_of_service == {"T.sp"} and statuses(world)[-1] == "failed"


def test_targets_are_the_same_within_the_tolerance() -> None:
    assert same(1.0, 1.1, 0.1) and not same(1.0, 1.1001, 0.1)
    assert same(None, None, 0.0) and not same(None, 0.0, 1.0) and not same(0.0, None, 1.0)
