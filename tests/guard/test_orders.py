"""Orders of people: what each does at once, what it leaves alone, and what is said where it is not carried out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import RequestAnswered, SequenceLoaded
from homeostat.domain.events.people import ModeEntered, PersonHeard, ServiceChanged
from homeostat.domain.events.trips import FallbackStands, LatchReset
from homeostat.domain.events.writes import StepLoaded, WriteEnded, WriteIntended
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.domain.recovery import Command
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from tests.guard.test_people import latched, tell
from tests.guard.vessel import MACHINE, RULES, Vessel, World, running, state, statuses

START = (
    Command("T.sp", 310.0, 0.5), Command("F.sp", 0.0, 0.005), Command("X.cmd", 1.0, None), Command("V.man", None, None),
)  # fmt: skip


def reset(**rest: Any) -> World:
    """A vessel that was shut by its fallback, reset, and is in closed loop again."""
    world = latched()
    assert tell(world, Verb.RESET, reason="repaired").done and tell(world, Verb.MODE, "closed-loop").done
    world.vessel.wire.clear()
    for name, value in rest.items():
        setattr(world.vessel, name, value)
    return world


def reason(world: World, verb: Any, subject: str = "", **rest: Any) -> str:
    """Why an order is not carried out."""
    heard = tell(world, verb, subject, **rest)
    assert not heard.done
    return heard.reason


def order(number: int, person: str = "Ada") -> PersonCommand:
    return PersonCommand(f"o{number}", person, Role.ENGINEER, Verb.RESET, reason="seen")


def with_guard(holds: Any) -> GuardRules:
    """The vessel's rules with another guard of the way back to the start."""
    back = replace(MACHINE.transitions[5], guard=holds)
    return replace(RULES, machine=replace(MACHINE, transitions=(*MACHINE.transitions[:5], back)))


def shut(rules: GuardRules = RULES, **rest: Any) -> World:
    """A guard that is attached to a vessel which is shut."""
    world = World(rules=rules, memory=Memory(mode=Mode.CLOSED_LOOP, state="shut", waiting=()), **rest)
    world.tick(3)
    return world


def test_every_order_is_journalled_as_it_was_given() -> None:
    world = running()
    tell(world, Verb.OUT_OF_SERVICE, "T.sp", id="o1", person="Bo", role=Role.OPERATOR, reason="repair")
    tell(world, Verb.RESET, "", id="o2", person="Cy", role=Role.ENGINEER, reason="seen")
    assert world.journal.of(PersonHeard) == [
        PersonHeard("o1", "Bo", Role.OPERATOR, "out-of-service", "T.sp", True, "repair"),
        PersonHeard("o2", "Cy", Role.ENGINEER, "reset", "", False, "nothing is latched"),
    ]
    assert world.journal.of(ServiceChanged) == [ServiceChanged("T.sp", False, "Bo", "repair")]


def test_an_order_that_breaks_something_is_answered() -> None:
    class Broken:
        text, tags = "broken", frozenset[str]()

        def __init__(self, error: Exception) -> None:
            self.error = error

        def holds(self, values: object) -> bool:
            raise self.error

    for error, why in ((ArithmeticError("no number"), "no number"), (ArithmeticError(), "ArithmeticError")):
        world = shut(with_guard(Broken(error)))
        assert reason(world, Verb.START, "restart") == f"the order could not be carried out: {why}"
        assert world.alarms == set()


def test_an_order_of_before_a_restart_is_not_carried_out_again() -> None:
    world = World(memory=Memory(mode=Mode.CLOSED_LOOP, orders=("o1",)))
    world.tick(2)
    assert reason(world, Verb.OUT_OF_SERVICE, "T.sp", id="o1", reason="r") == "order 'o1' was answered already"
    assert tell(world, Verb.OUT_OF_SERVICE, "T.sp", id="o2", reason="r").done


def test_a_mode_change_overtakes_what_is_on_the_wire() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask()
    world.tick()
    assert tell(world, Verb.MODE, "approve", person="Bo").done
    ended = world.journal.of(WriteEnded)[-1]
    assert (ended.result.value, ended.detail) == ("given-up", "Bo changed the mode")
    assert statuses(world)[-1] == "withdrawn"
    (answered,) = [e for e in world.journal.of(RequestAnswered) if e.status == "withdrawn"]
    assert answered.reason == "Bo changed the mode to 'approve'"
    assert [e.at_s for e in world.seen[-1].answers] == [world.seen[-1].now_s]


def test_a_mode_change_leaves_the_fallback_on_the_wire_alone() -> None:
    world = running()
    world.vessel.hangs = True
    world.tick(2, L=14.0)
    assert len(world.sent) == 1
    ended = len(world.journal.of(WriteEnded))
    assert tell(world, Verb.MODE, "observe").done
    assert len(world.journal.of(WriteEnded)) == ended and len(world.sent) == 1
    for mode in ("approve", "closed-loop"):
        assert reason(world, Verb.MODE, mode) == "a fallback is latched; reset it first"


def test_a_reset_needs_an_answer_of_the_plant_that_is_not_too_old() -> None:
    world = latched()
    world.vessel.accepted.clear()
    why = "the plant does not answer; nobody can say in which state it would be left"
    assert reason(world, Verb.RESET, reason="seen") == why

    def after(silence_s: int) -> PersonHeard:
        world = latched()
        world.guard.mailbox.put(PersonCommand("o1", "Ada", Role.ENGINEER, Verb.MODE, "observe"))
        world.silent(silence_s - 1)
        world.guard.mailbox.put(PersonCommand("o2", "Ada", Role.ENGINEER, Verb.RESET, reason="seen"))
        world.silent()
        heard: PersonHeard = world.journal.of(PersonHeard)[-1]
        return heard

    assert after(1).done and not after(30).done and after(30).reason == why
    world = running(settings=GuardSettings(again_s=2.0, sync_s=5.0))
    world.tick(4, L=14.0)
    world.silent()
    world.guard.mailbox.put(order(1))
    world.silent()
    assert world.journal.of(PersonHeard)[-1].done  # 2 s old
    world = running(settings=GuardSettings(again_s=2.0, sync_s=5.0))
    world.tick(4, L=14.0)
    world.silent(2)
    world.guard.mailbox.put(order(1))
    world.silent()
    assert world.journal.of(PersonHeard)[-1].reason == why


def test_a_reset_before_the_plant_was_read_is_refused() -> None:
    world = World(memory=Memory(mode=Mode.CLOSED_LOOP, latched="a trip", acted="drain", state="shut"))
    world.guard.mailbox.put(order(1))
    world.silent()
    heard = world.journal.of(PersonHeard)[-1]
    assert heard.reason == "the fallback is not confirmed by the plant yet; a reset would leave it half done"


def test_after_a_reset_the_guard_stands_where_the_plant_is() -> None:
    world = latched()
    world.vessel.accepted.update({"T.sp": 305.0, "X.cmd": 1.0, "F.sp": 0.03, "V.man": 0.5})
    assert tell(world, Verb.RESET, reason="brought back by hand").done
    assert world.journal.of(LatchReset)[-1].state == "running" == world.seen[-1].state
    assert world.journal.of(ModeEntered)[-1] == ModeEntered("observe", "Ada", "reset")
    assert reason(world, Verb.RESET, reason="again") == "nothing is latched"


def test_an_ordered_fallback_withdraws_what_was_asked_and_says_so() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    assert tell(world, Verb.FALL_BACK, reason="smoke").done
    (answer,) = world.seen[-1].answers
    assert (answer.reason, answer.at_s) == ("a person ordered the fallback", world.seen[-1].now_s)


def test_a_start_is_made_once_and_stands_at_once() -> None:
    world = reset()
    loads = len(world.journal.of(SequenceLoaded))
    assert tell(world, Verb.START, "restart").done
    assert world.seen[-1].state == "waiting" and world.sent == [START]
    world.tick(3, L=1.0)
    assert world.journal.of(SequenceLoaded)[loads:] == [
        SequenceLoaded(
            "restart", "waiting",
            (StepLoaded("start", (
                Command("T.sp", 310.0, 0.5), Command("F.sp", 0.03, 0.005), Command("V.man", None, None),
                Command("X.cmd", 1.0, None),
            )), StepLoaded("empty", (Command("F.sp", 0.0, 0.005), Command("V.man", 1.0, 0.2))),
             StepLoaded("end", (Command("F.sp", 0.0, 0.005),))),
            False,
        )
    ]  # fmt: skip
    assert world.alarms == set()


def test_a_start_that_the_plant_holds_before_the_link_says_so_is_made() -> None:
    world = reset(silent=True)
    assert tell(world, Verb.START, "restart").done
    assert world.seen[-1].state == "shut"
    world.tick()
    assert world.seen[-1].state == "waiting" and world.alarms == set()


def test_a_start_that_the_link_takes_is_made_though_the_plant_does_not_hold_it_yet() -> None:
    world = reset(ignores=True)
    assert tell(world, Verb.START, "restart").done
    assert world.seen[-1].state == "waiting"


def test_a_start_that_a_trip_overtakes_is_not_made() -> None:
    world = reset(hangs=True)
    assert tell(world, Verb.START, "restart").done
    loads = len(world.journal.of(SequenceLoaded))
    world.vessel.hangs = False
    world.tick(5, L=14.0)
    assert world.journal.of(FallbackStands) and world.seen[-1].state == "shut"
    assert [e.source for e in world.journal.of(SequenceLoaded)[loads:]] == ["drain"]


def test_a_start_that_a_mode_change_overtakes_is_not_made_and_can_be_ordered_again() -> None:
    world = reset(hangs=True)
    assert tell(world, Verb.START, "restart").done
    assert tell(world, Verb.MODE, "approve").done
    world.vessel.hangs = False
    world.tick(2)
    assert world.seen[-1].state == "shut" and world.alarms == set()
    assert tell(world, Verb.START, "restart").done and world.seen[-1].state == "waiting"


def test_a_start_waits_for_no_write_that_is_under_way_and_withdraws_what_was_asked() -> None:
    world = reset(hangs=True)
    assert tell(world, Verb.START, "restart").done
    assert reason(world, Verb.START, "restart") == "another write is under way; order it again"
    assert [w.cause.value for w in world.journal.of(WriteIntended)] == ["sequence", "fallback", "person"]
    world = reset()
    assert tell(world, Verb.MODE, "approve").done
    world.guard.mailbox.put(world.request())
    assert tell(world, Verb.START, "restart").done
    (answer,) = [a for a in world.seen[-1].answers if a.status.final]
    assert (answer.reason, answer.at_s) == ("Ada ordered a start", world.seen[-1].now_s)


def test_a_start_needs_a_reading_a_journal_and_a_transition_that_somebody_decides_on() -> None:
    world = World(memory=Memory(mode=Mode.CLOSED_LOOP, state="shut", waiting=()))
    world.guard.mailbox.put(PersonCommand("o1", "Ada", Role.ENGINEER, Verb.START, "restart"))
    world.silent()
    assert world.journal.of(PersonHeard)[-1].reason == "there is no reading to decide on"
    world = reset()
    world.journal.error = OSError("disk full")
    world.guard.mailbox.put(PersonCommand("o1", "Ada", Role.ENGINEER, Verb.START, "restart"))
    world.tick()
    world.journal.error = None
    world.tick(2)
    heard = world.journal.of(PersonHeard)[-1]
    assert heard.reason == "the intention could not be journalled: the journal failed: disk full"
    assert world.sent == [] and world.seen[-1].state == "shut"
    world = World(vessel=Vessel())
    world.tick(1, L=1.0)
    assert reason(world, Verb.START, "start") == "'start' is taken by itself once its guard holds: 'L >= 5'"


@pytest.mark.parametrize(
    ("ranges", "why"),
    [
        ((SetpointRange("T.sp", 298.0, 302.0, 310.0),), "'T.sp' = 310 K in state 'waiting'; admitted are 298 to 302 K"),
        ((SetpointRange("L", 0.0, 1.0, 1.0),), "'L' is not a tag that may be written"),
        ((SetpointRange("F.sp", 0.0, 0.05, 0.03), SetpointRange("X.cmd", 0.0, 1.0, 0.0)), "PRM-OPEN"),
    ],
)
def test_a_start_by_wrong_tables_is_refused(ranges: tuple[SetpointRange, ...], why: str) -> None:
    machine = replace(MACHINE, states=(state("waiting", *ranges, initial=True), *MACHINE.states[1:]))
    world = shut(replace(RULES, machine=machine))
    assert why in reason(world, Verb.START, "restart")
    assert world.sent == []


def test_a_start_commands_nothing_that_is_out_of_service() -> None:
    world = reset()
    assert tell(world, Verb.OUT_OF_SERVICE, "T.sp", reason="hand").done
    assert reason(world, Verb.START, "restart") == "'T.sp' is out of service; a person must bring it back"
