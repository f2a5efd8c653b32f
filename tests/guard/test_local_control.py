"""What the plant's own control does while nobody holds the lease: told with its figures, once, and fallen in with."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import SequenceLoaded
from homeostat.domain.events.people import AlarmRaised, PersonHeard
from homeostat.domain.events.writes import LeaseLost, LeaseTried, WriteEnded
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.domain.recovery import Command, Step
from homeostat.guard.parts import Parts
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from tests.guard.test_hands import dies
from tests.guard.test_lapse import MORE, Sheds, causes, lapsing
from tests.guard.test_orders import reset
from tests.guard.test_people import tell
from tests.guard.vessel import BEGIN, MACHINE, POUR, RULES, Journal, World, running, state


def told(world: World) -> list[tuple[str, str]]:
    return [(e.cause, e.priority.name) for e in world.journal.of(AlarmRaised) if e.alarm == "local"]


MOVED = "the plant's own control moved V.man from {} to automatic; {}"


def test_what_was_moved_is_told_once_and_where_the_sequence_stands() -> None:
    world, vessel = lapsing()
    vessel.shed()
    world.tick(5)
    assert told(world) == [(MOVED.format("0.4", "the sequence goes on in state 'running'"), "HIGH")]
    assert world.alarms == set() and [e.source for e in world.journal.of(SequenceLoaded)] == ["r1"]


def test_a_recipe_that_was_followed_is_told_with_the_state_that_it_led_to() -> None:
    last = Step(RULES.machine.transitions[3], (Command("F.sp", 0.0, 0.005), Command("V.man", None, None)))
    world = World(vessel=Sheds(), rules=replace(RULES, nominal=(BEGIN, POUR, last)))
    world.tick(4)
    world.tick(4, L=9.5)
    assert isinstance(world.vessel, Sheds) and world.seen[-1].state == "emptying"
    world.vessel.tells = True
    world.vessel.shed()
    world.tick(3)
    assert told(world) == [(MOVED.format("1", "the sequence goes on from state 'rest'"), "HIGH")]
    assert world.journal.of(SequenceLoaded)[-1] == SequenceLoaded("local control", "rest", (), False)
    assert world.seen[-1].state == "rest"


def test_a_sequence_that_has_stopped_says_in_which_state() -> None:
    world = World(vessel=Sheds(), rules=MORE)
    world.tick(4)
    world.tick(4, L=9.5)
    assert isinstance(world.vessel, Sheds)
    world.vessel.tells = True
    world.vessel.shed()
    world.tick(3)
    why = "state 'emptying' does not admit that, so the sequence has stopped; recovery or a person must act"
    assert told(world) == [(MOVED.format("1", why), "HIGH")]


def test_a_fallback_that_stood_says_whether_it_is_put_right() -> None:
    world, vessel = lapsing()
    world.tick(5, L=14.0)
    vessel.shed()
    world.tick(3)
    assert told(world) == [(MOVED.format("1", "the fallback is put right"), "HIGH")]
    before = running()
    before.tick(5, L=14.0)
    world = dies(before, {"V.man": None}, goes_on=False)
    world.tick(3)
    assert told(world) == [(MOVED.format("1", "the fallback stands no more, and nobody writes"), "HIGH")]


def test_a_fallback_that_is_being_sent_says_so() -> None:
    world, vessel = lapsing()
    vessel.ignores = True
    world.tick(1, L=14.0)
    vessel.shed()
    world.tick(3)
    assert told(world) == [(MOVED.format("0.4", "the fallback is being sent"), "HIGH")]


def test_what_was_moved_and_moved_back_is_not_told() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(2)
    vessel.accepted["V.man"] = 0.4
    world.tick(2)
    vessel.keeps = False
    world.tick(15)
    assert told(world) == []


def test_what_was_moved_before_the_lease_was_given_back_is_not_told_in_a_later_lapse() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(2)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick(15)
    vessel.keeps = False
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    world.tick(3)
    vessel.shed()
    world.tick(3)
    assert len(world.journal.of(LeaseLost)) == 2 and told(world) == [] and world.alarms == set()


def test_a_lease_that_is_given_back_in_the_tick_in_which_it_was_taken_again_is_not_lost_any_more() -> None:
    world, vessel = lapsing()
    world.order(Verb.MODE, Mode.OBSERVE.value)
    vessel.shed()
    world.tick()
    assert [e.given for e in world.journal.of(LeaseTried)] == [True] and "heartbeat" not in world.alarms
    world.tick(3)
    assert len(world.journal.of(LeaseTried)) == 1 and world.guard.mode is Mode.OBSERVE


def test_a_start_on_a_wire_that_is_lost_is_given_up_and_told() -> None:
    vessel = Sheds(X_cmd=0.0, V_man=1.0)
    world = World(memory=Memory(Mode.CLOSED_LOOP, state="shut", waiting=()), vessel=vessel)
    world.tick(3)
    vessel.hangs = True
    assert tell(world, Verb.START, "restart").done
    vessel.deaf = True
    world.tick(2)
    assert causes(world, "write:person") == ["what Ada ordered was given up: the heartbeat is not taken: no answer"]
    assert [e.detail for e in world.journal.of(WriteEnded)][-1] == "the lease was lost"
    assert world.seen[-1].state == "shut"


def test_a_start_while_the_lease_is_lost_says_how_it_was_lost() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick()
    world.ask(name="r2")
    world.order(Verb.START, "adjust")
    world.tick()
    assert world.journal.of(PersonHeard)[-1].reason == "the lease is lost: the plant says that the lease is over"
    (answer,) = [a for a in world.seen[-1].answers if a.status.final]
    assert answer.reason == (
        "nothing can be written: the plant says that the lease is over; ask again when the guard has the lease"
    )


def test_a_request_on_a_lost_wire_says_how_the_lease_was_lost() -> None:
    world, vessel = lapsing()
    vessel.hangs = True
    world.ask(name="r2")
    world.tick()
    vessel.shed()
    world.tick()
    (answer,) = [a for a in world.seen[-1].answers if a.status.final]
    assert answer.reason == "the lease was lost: the plant says that the lease is over"
    assert answer.at_s == world.seen[-1].now_s


class Asked(Sheds):
    """A plant that counts how often its lease is asked for."""

    asked = 0

    def take(self) -> Any:
        self.asked += 1
        return super().take()


def leased(**rest: Any) -> tuple[Parts, Asked, Journal]:
    """The parts of a guard with a lease that was taken at 0 s and is over."""
    vessel, journal = Asked(), Journal()
    parts = Parts.of(RULES, journal, vessel, GuardSettings(**rest))
    assert parts.tenure.take(0.0) == "" and parts.tenure.held
    vessel.void = True
    return parts, vessel, journal


def test_attempts_at_a_lease_come_at_once_then_after_waits_that_double_up_to_the_longest() -> None:
    parts, vessel, _ = leased(attempts=3, again_s=10.0)
    vessel.keeps, tried = True, list[int]()
    parts.tenure.check(100.0)
    for now_s in range(100, 3700):
        for _ in range(2):  # it is asked twice in a tick
            before = vessel.asked
            assert not parts.tenure.retake(float(now_s))
            tried += [now_s - 100] * (vessel.asked - before)
    assert tried == [0, 1, 2, 12, 32, 72, 152, 312, 632, 1232, 1832, 2432, 3032]


@pytest.mark.parametrize(("lasted_s", "attempt"), [(9.9, 2), (10.0, 1), (10.1, 1)])
def test_a_lease_that_has_lasted_is_taken_again_as_if_for_the_first_time(lasted_s: float, attempt: int) -> None:
    parts, vessel, journal = leased(again_s=10.0)
    parts.tenure.check(100.0)
    assert parts.tenure.retake(100.0)
    parts.tenure.settle(101.0)
    vessel.void = True
    parts.tenure.check(100.0 + lasted_s)
    assert parts.tenure.lost == "the plant says that the lease is over" and not parts.tenure.held
    assert parts.tenure.retake(100.0 + lasted_s)
    parts.recorder.settle()
    assert [e.attempt for e in journal.of(LeaseTried)] == [1, attempt]


def test_nobody_takes_a_lease_again_that_was_not_lost() -> None:
    parts, vessel, journal = leased()
    vessel.void = False
    parts.tenure.check(100.0)
    assert parts.tenure.lost == "" and not parts.tenure.retake(200.0)
    parts.tenure.give_back(300.0)
    assert parts.tenure.given_back_s == 300.0 and not parts.tenure.retake(400.0) and vessel.leases == 1
    parts.recorder.settle()
    assert journal.of(LeaseTried) == [] and journal.of(LeaseLost) == []


def test_a_start_whose_later_step_is_not_admitted_is_refused_by_the_name_of_the_check() -> None:
    emptying = state("emptying", SetpointRange("F.sp", 0.0, 0.01, 0.02), target=True)
    machine = replace(MACHINE, states=(*MACHINE.states[:2], emptying, *MACHINE.states[3:]))
    world = reset()
    world = dies(world, {}, rules=replace(RULES, machine=machine))
    world.tick(2)
    heard = tell(world, Verb.START, "restart")
    assert (heard.done, heard.check) == (False, "CHK-RANGE")
    assert heard.reason == "'F.sp' = 0.02 L/s in state 'emptying'; admitted are 0 to 0.01 L/s"


def test_a_start_on_a_reading_above_a_limit_is_refused_and_can_be_ordered_again() -> None:
    world = reset()
    world.vessel.values["L"] = 12.08
    heard = tell(world, Verb.START, "restart")
    assert not heard.done and heard.check == "LIM-FULL" and heard.reason.startswith("hard limit at release: ")
    world.vessel.values["L"] = 8.0
    assert tell(world, Verb.START, "restart").done
    assert world.sent[0][0] == Command("T.sp", 310.0, 0.5)


def test_what_moves_right_after_a_lost_lease_is_not_wanted_any_more_is_the_plant_s_own_control() -> None:
    world, vessel = lapsing(keeps=True)
    vessel.shed()
    world.tick(5)
    world.order(Verb.MODE, Mode.OBSERVE.value)
    world.tick()
    vessel.accepted["V.man"] = None
    world.tick()
    assert world.guard.out_of_service == frozenset()
    vessel.accepted["T.sp"] = 301.0
    world.tick()
    assert world.guard.out_of_service == {"T.sp"}


def test_a_lapse_by_a_death_ends_with_the_first_reading() -> None:
    world = dies(running(), {})
    world.tick(2)
    world.vessel.accepted["V.man"] = 0.4
    world.tick()
    assert tell(world, Verb.IN_SERVICE, "V.man").done
    world.vessel.accepted["V.man"] = None  # what local control would do, too
    world.tick()
    assert world.guard.out_of_service == {"V.man"}
