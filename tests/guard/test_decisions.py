"""What the guard decides besides tripping: its alarms, its end, retries, messages, and a time to act by."""

from __future__ import annotations

import asyncio
import itertools
import threading
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import Armed, Stopped
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import Latched, Tripped
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.observation import Arm, Correction, FallBack, Settled, Trouble
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.restart.memory import Memory
from tests.guard.vessel import ADJUSTED, RULES, Journal, Vessel, World, running, statuses

pytestmark = pytest.mark.quick


def causes(world: World, name: str) -> list[str]:
    return [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == name]


def test_a_guard_needs_no_settings() -> None:
    guard = Guard(RULES, Attachment(Journal(), Vessel(), Mode.OBSERVE))
    assert guard.tick(1.0, Vessel().sample()).state == "running"
    guard.stop("done")


@pytest.mark.parametrize(("error", "said"), [(KeyError(), "KeyError"), (ValueError("no such rule"), "no such rule")])
def test_a_stage_that_fails_is_an_alarm_with_its_text_or_its_name(error: Exception, said: str) -> None:
    world = running()

    def broken(*_: object) -> Any:
        raise error

    judge, world.guard._trips.judge = world.guard._trips.judge, broken  # type: ignore[method-assign]
    world.tick()
    assert causes(world, "guard:trip") == [f"trip: {said}"] and "guard:trip" in world.alarms
    world.guard._trips.judge = judge  # type: ignore[method-assign]
    world.tick()
    assert "guard:trip" not in world.alarms


def test_a_stop_is_wanted_once_synced_and_answered() -> None:
    before = {t for t in threading.enumerate() if t.name == "guard-recorder"}
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    assert statuses(world)[-1] == "offered"
    syncs = world.journal.syncs
    world.guard.stop("the night")
    world.guard.stop("twice")
    world.tick()
    answer = world.seen[-1].answers[-1]
    assert (answer.status.value, answer.reason.rpartition(": ")[2]) == ("withdrawn", "the night")
    assert [e.reason for e in world.journal.of(Stopped)] == ["the night"] and world.journal.syncs > syncs
    assert not {t for t in threading.enumerate() if t.name == "guard-recorder"} - before


def test_a_sample_without_trouble_is_passed_on_as_it_came() -> None:
    world = running()
    sample = world.vessel.sample()
    assert world.guard.tick(sample.at_s, sample).sample is sample
    stale = replace(sample, at_s=float("nan"))
    assert world.guard.tick(sample.at_s + 1.0, stale).sample is None


def test_the_first_of_several_limits_is_why_a_fallback_acts() -> None:
    world = running()
    world.tick(1, T=370.0, Tx=370.0, L=13.9)
    assert world.guard.latched is not None and "LIM-HOT" in world.guard.latched


def test_a_fallback_that_nobody_may_send_is_wanted_while_the_limit_is_violated() -> None:
    world = running(mode=Mode.OBSERVE)
    world.tick(3, T=370.0, Tx=370.0)
    assert "fallback wanted" in world.alarms and world.guard.latched is None
    world.tick(30, T=290.0, Tx=290.0)
    assert "fallback wanted" not in world.alarms


def test_under_a_latch_no_other_fallback_is_wanted() -> None:
    world = running()
    world.tick(3, T=370.0, Tx=370.0)
    world.order(Verb.MODE, "observe")
    world.tick(3)
    assert world.guard.latched is not None and "fallback wanted" not in world.alarms


def test_only_a_request_stops_the_time_by_which_recovery_must_have_acted() -> None:
    world = World()
    world.guard.mailbox.put(Arm(("drain",), 6.0))
    world.tick(5)
    assert world.seen[-1].state == "running" and world.guard.latched is None  # a step of the sequence was confirmed
    world.tick(1)
    assert world.guard.latched == "recovery has not acted in the time that physics leaves"


def test_a_time_to_act_by_is_over_with_a_fallback_that_a_person_has_ordered() -> None:
    world = running()
    world.guard.mailbox.put(Arm(("drain",), 12.0))
    world.tick()
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick(4)
    world.order(Verb.RESET, reason="it was dust")
    world.tick(8)
    assert world.guard.latched is None and len(world.journal.of(Latched)) == 1
    assert causes(world, "fallback wanted") == []


def test_what_waits_for_a_person_is_withdrawn_when_a_fallback_acts() -> None:
    world = running(mode=Mode.APPROVE)
    asked = world.ask()
    world.tick()
    world.order(Verb.FALL_BACK, reason="smoke")
    world.order(Verb.APPROVE, asked.id, digest=asked.actions.digest)
    world.tick(3)
    assert statuses(world)[-1] == "withdrawn" and ADJUSTED.commands not in world.sent


def test_a_step_is_tried_again_near_a_limit_and_a_request_is_not() -> None:
    world = World()
    world.vessel.raises = True
    world.tick()
    assert len(world.sent) == 1
    world.vessel.raises = False
    world.tick(1, T=317.0, Tx=317.0)  # half way to a trip
    assert len(world.sent) == 2 and world.seen[-1].state == "running"


def test_a_request_that_is_not_tried_again_names_the_first_limit() -> None:
    world = running()
    world.vessel.raises = True
    world.ask(actions=ActionSet((Command("T.sp", 305.0, 0.5),), "running"))
    world.tick()
    world.tick(1, T=317.0, Tx=317.0, L=12.5)
    assert statuses(world)[-1] == "failed" and "LIM-HOT" in world.seen[-1].answers[-1].reason


class Odd(Correction):
    """A correction that breaks when it is read."""

    def __getattribute__(self, name: str) -> Any:
        if name == "errors":
            raise object.__getattribute__(self, "said")
        return object.__getattribute__(self, name)


@pytest.mark.parametrize(("said", "text"), [(KeyError(), "KeyError"), (ValueError("a riddle"), "a riddle")])
def test_a_message_that_breaks_is_an_alarm_with_its_text_or_its_name(said: Exception, text: str) -> None:
    world = running()
    odd = object.__new__(Odd)
    object.__setattr__(odd, "said", said)
    world.guard.mailbox.put(odd)
    world.guard.mailbox.put(FallBack("the next message"))
    world.tick()
    assert causes(world, "mailbox") == [f"a message could not be taken: {text}"]
    assert world.guard.latched == "the next message"


@pytest.mark.parametrize("name", ["link", "latched", "trip:LIM-FULL", "journal"])
def test_nobody_begins_or_ends_an_alarm_of_the_guards_own(name: str) -> None:
    world = running()
    world.guard.mailbox.put(Trouble(name, "all is well"))
    world.tick()
    assert causes(world, name) == [] and causes(world, f"recovery:{name}") == ["all is well"]
    world.silent(10)
    world.tick(3, L=14.0)
    standing = world.alarms - {f"recovery:{name}"}
    world.guard.mailbox.put(Settled(name))
    world.guard.mailbox.put(Settled("nothing of that name"))
    world.tick()
    assert standing and world.alarms == standing and causes(world, "mailbox") == []


@pytest.mark.parametrize(("name", "alarm"), [
    ("store", "recovery:store"), ("recovery:store", "recovery:store"), ("source", "source"),
    ("source:clock", "source:clock"), ("sources", "recovery:sources"), ("x" * 101, "recovery:" + "x" * 100),
])  # fmt: skip
def test_a_trouble_lasts_until_whoever_has_it_says_that_it_is_over(name: str, alarm: str) -> None:
    world = running()
    world.guard.mailbox.put(Trouble(name, "it does not answer" * 50))
    world.tick(3)
    assert alarm in world.alarms and [len(c) for c in causes(world, alarm)] == [500]
    world.guard.mailbox.put(Settled(name))
    world.tick()
    assert alarm not in world.alarms


def test_so_many_troubles_last_and_no_more() -> None:
    world = running()
    for n in range(60):
        world.guard.mailbox.put(Trouble(f"t{n % 30}-{n}", "it does not answer"))
        world.tick()
    lasting = [name for name in world.alarms if name.startswith("recovery:")]
    assert len(lasting) == 50 and "more than 50 troubles at once" in causes(world, "mailbox")[0]
    world.guard.mailbox.put(Trouble("t0-0", "again"))  # it lasts already
    world.guard.mailbox.put(Settled("t1-1"))
    world.guard.mailbox.put(Trouble("new", "there is room"))
    before = len(causes(world, "mailbox"))
    world.tick()
    assert "recovery:new" in world.alarms and len(causes(world, "mailbox")) == before


@pytest.mark.parametrize("message", [Arm(("drain",)), Correction(({},)), Trouble("store", "it does not answer")])
def test_a_tick_hears_so_many_messages_of_one_kind(message: Any) -> None:
    world = running()
    for _ in range(50):
        world.guard.mailbox.put(message)
    world.tick()
    assert causes(world, "mailbox") == []
    for _ in range(51):
        world.guard.mailbox.put(message)
    world.guard.mailbox.put(FallBack("the last message"))
    world.tick()
    assert "more than 50 messages of this kind came at once" in causes(world, "mailbox")[0]
    assert world.guard.latched == "the last message"


def test_a_ranking_has_no_more_names_than_a_tick_can_check() -> None:
    world = running()
    world.guard.mailbox.put(Arm(("drain",) * 50))
    world.tick()
    assert len(world.journal.of(Armed)) == 1 and causes(world, "mailbox") == []
    world.guard.mailbox.put(Arm(itertools.repeat("drain")))  # type: ignore[arg-type]
    world.tick()
    assert len(world.journal.of(Armed)) == 1 and "more than 50 fallbacks" in causes(world, "mailbox")[0]


def test_a_fallback_that_recovery_wants_stays_an_alarm_until_it_has_something_better() -> None:
    world = running(mode=Mode.OBSERVE)
    world.guard.mailbox.put(FallBack("nothing helps"))
    world.tick(20)
    assert "fallback wanted" in world.alarms
    world.ask()
    world.tick(2)
    assert "fallback wanted" not in world.alarms
    world.guard.mailbox.put(FallBack("nothing helps"))
    world.tick(2)
    world.order(Verb.MODE, "closed-loop")
    world.tick(2)
    assert "fallback wanted" not in world.alarms and world.guard.latched is None


class Ends(BaseException):
    """What would end a program."""


@pytest.mark.parametrize("error", [asyncio.CancelledError, SystemExit, GeneratorExit, Ends])
@pytest.mark.parametrize("call", ["send", "beat", "take", "give_back", "void"])
@pytest.mark.parametrize("blocks", [False, True])
def test_whatever_a_link_raises_ends_nothing(error: type[BaseException], call: str, blocks: bool) -> None:
    def broken(*_: object) -> Any:
        raise error

    kind = type("Broken", (Vessel,), {call: property(broken) if call == "void" else broken, "never_blocks": not blocks})
    world = World(vessel=kind(), mode=Mode.OBSERVE if call == "take" else Mode.CLOSED_LOOP)
    world.tick(5)
    world.order(Verb.MODE, "closed-loop")
    world.tick(6, L=14.0)
    assert world.journal.of(Tripped)
    assert not [name for name in world.alarms if name.startswith("guard:")]
    world.order(Verb.MODE, "observe")
    world.tick(2)
    world.guard.stop("the end")


@pytest.mark.parametrize("error", [asyncio.CancelledError, SystemExit, Ends])
def test_whatever_a_rule_raises_ends_nothing(error: type[BaseException]) -> None:
    world = running()

    def broken(*_: object) -> Any:
        raise error

    world.guard._trips.judge = broken  # type: ignore[method-assign]
    world.tick()
    assert causes(world, "guard:trip") == [f"trip: {error.__name__}"]


def test_a_persons_interrupt_goes_on_its_way() -> None:
    world = running()

    def interrupted(*_: object) -> Any:
        raise KeyboardInterrupt

    world.guard._trips.judge = interrupted  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        world.tick()


class Choosy(Journal):
    """A record that cannot take one kind of event."""

    def record(self, event: Any, at_s: float) -> None:
        if isinstance(event, AlarmRaised) and event.alarm == "recovery:store":
            raise TypeError("no such kind")
        super().record(event, at_s)


def test_each_event_that_is_lost_is_said_once() -> None:
    world = running(record=Choosy())
    world.guard.mailbox.put(Trouble("store", "it does not answer"))
    world.tick(5)
    assert causes(world, "journal:lost") == ["1 events could not be journalled"]


def test_decisions_wait_until_the_plant_was_read_after_a_restart() -> None:
    world = World(memory=Memory(state="waiting", mode=Mode.CLOSED_LOOP), goes_on=True)
    for _ in range(3):
        sample = world.vessel.sample()
        world.seen.append(world.guard.tick(sample.at_s, Snapshot(sample.at_s, sample.values, accepted={})))
    assert world.sent == []
    world.tick(3)
    assert world.seen[-1].state == "running" and len(world.sent) == 1
