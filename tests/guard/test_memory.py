"""What a journal says of the guard, and what a restart makes of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from homeostat.domain.events.guard import RequestAnswered, SequenceLoaded, StateEntered, StepTaken
from homeostat.domain.events.people import AlarmRaised, ModeEntered, PersonHeard, ServiceChanged
from homeostat.domain.events.trips import FallbackActivated, FallbackIneffective, FallbackStands, Latched, LatchReset
from homeostat.domain.events.writes import Cause, ReadBack, StepLoaded, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.mode import Mode, Role, Verb
from homeostat.domain.ports import GuardEvent
from homeostat.domain.recovery import Command
from homeostat.guard.restart.memory import Memory
from homeostat.guard.settings import GuardSettings
from homeostat.guard.writing.flight import PUT_RIGHT
from homeostat.journal.encode import encode_fields
from tests.guard.vessel import ADJUSTED, DRAIN, ROUTE, Vessel, World

POUR = ("empty", ROUTE.then[0].commands)
STEPS = (StepLoaded(*POUR),)


@dataclass(frozen=True)
class Line:
    kind: str
    fields: dict[str, Any]


def remembered(*events: GuardEvent) -> Memory:
    return Memory.of(Line(e.kind, encode_fields(e, e.kind)) for e in events)


def intended(number: int, cause: Cause, source: str, attempt: int = 1, **rest: Any) -> WriteIntended:
    fields: dict[str, Any] = {"commands": ADJUSTED.commands, "digest": "", "state": "running"} | rest
    return WriteIntended(number, attempt, cause, source, **fields)


REQUEST = intended(3, Cause.REQUEST, "r1", steps=STEPS)
FALLBACK = intended(4, Cause.FALLBACK, "drain", commands=DRAIN.actions.commands, state="shut")
GIVEN_UP = WriteEnded(3, 1, WriteResult.GIVEN_UP, "a fallback acts")
TAGS = ("T.sp", "F.sp")


def test_what_was_said_is_remembered() -> None:
    memory = remembered(
        ModeEntered("approve", "Ada"), StateEntered("running"), ServiceChanged("T.sp", False, "", "moved"),
        ServiceChanged("F.sp", False, "", "moved"), ServiceChanged("F.sp", True, "Ada", ""),
        RequestAnswered("r1", "search", "", "authorised"), RequestAnswered("r2", "search", "", "refused"),
        PersonHeard("o1", "Ada", Role.OPERATOR, Verb.IN_SERVICE, "F.sp", True),
        PersonHeard("o2", "Ada", Role.OPERATOR, Verb.RESET, "", False), AlarmRaised("a", "b", None),  # type: ignore[arg-type]
    )  # fmt: skip
    assert (memory.mode, memory.state, memory.out) == (Mode.APPROVE, "running", {"T.sp"})
    assert (memory.requests, memory.orders) == (("r1",), ("o1", "o2"))
    assert memory.waiting is None and memory.latched is None and memory.writes == 0


def test_an_intention_that_was_not_read_back_is_open() -> None:
    memory = remembered(REQUEST)
    assert memory.writes == 3 and memory.open[3].steps == (POUR,) and memory.latched is None
    assert remembered(REQUEST, ReadBack(3, (), TAGS)).open == {}


def test_what_was_read_to_stand_counts_though_nothing_follows_in_the_journal() -> None:
    memory = remembered(REQUEST, ReadBack(3, TAGS))
    assert (memory.state, memory.waiting, memory.aborting) == ("running", (POUR,), False)
    step = intended(4, Cause.SEQUENCE, "empty", state="emptying")
    memory = remembered(REQUEST, ReadBack(3, TAGS), step, ReadBack(4, TAGS))
    assert (memory.state, memory.waiting) == ("emptying", ())
    assert remembered(REQUEST, ReadBack(3, TAGS), step, ReadBack(4, TAGS), StepTaken("empty", "emptying")) == memory
    memory = remembered(FALLBACK, ReadBack(4, ("X.cmd",)))
    assert (memory.state, memory.strategy, memory.acted, memory.aborting) == ("shut", "", "drain", True)
    assert memory.latched == "fallback 'drain' was being written"


def test_what_was_overtaken_moves_no_sequence() -> None:
    for memory in (
        remembered(REQUEST, GIVEN_UP, ReadBack(3, TAGS)), remembered(REQUEST, FALLBACK, ReadBack(3, TAGS)),
        remembered(REQUEST, WriteEnded(3, 1, WriteResult.FAILED), ReadBack(3, (), TAGS)),
    ):  # fmt: skip
        assert memory.state == "" and memory.waiting in (None, ())


def test_nothing_that_waited_before_a_fallback_waits_behind_its_intention() -> None:
    memory = remembered(SequenceLoaded("r1", "running", STEPS, False), FALLBACK)
    assert memory.waiting == () and memory.aborting and memory.strategy == memory.acted == "drain"
    later = SequenceLoaded("drain", "shut", STEPS, True)
    again = intended(4, Cause.FALLBACK, "drain", attempt=2)
    assert remembered(FALLBACK, later, again).waiting == (POUR,)
    put_right = intended(5, Cause.FALLBACK, PUT_RIGHT)
    memory = remembered(FALLBACK, later, FallbackStands("drain"), put_right)
    assert memory.waiting == (POUR,) and memory.strategy == "" and memory.acted == "drain" and 5 in memory.open
    assert remembered(put_right).latched is None
    assert remembered(FALLBACK, FallbackStands("close")).strategy == "drain"


def test_a_step_that_counts_as_taken_and_is_not_held_is_owed() -> None:
    step = intended(2, Cause.SEQUENCE, "start")
    taken = StepTaken("start", "running")
    memory = remembered(step, taken, ReadBack(2, (), TAGS))
    assert memory.owed is not None and memory.owed.source == "start"
    assert remembered(step, ReadBack(2, (), TAGS)).owed is None
    for after in (
        intended(2, Cause.SEQUENCE, "start", attempt=2), intended(3, Cause.SEQUENCE, "start"), FALLBACK,
        SequenceLoaded("r1", "running", (), False),
    ):  # fmt: skip
        assert remembered(step, taken, ReadBack(2, (), TAGS), after).owed is None
    again = intended(2, Cause.SEQUENCE, "start", attempt=2)
    assert remembered(step, taken, ReadBack(2, (), TAGS), again, ReadBack(2, (), TAGS)).owed is not None


def test_a_reset_ends_everything_that_a_fallback_began() -> None:
    memory = remembered(FALLBACK, FallbackActivated("drain", (), "hot"), Latched("hot"))
    assert memory.latched == "hot"
    memory = remembered(
        FALLBACK, FallbackActivated("drain", (), "hot"), Latched("hot"), LatchReset(("Ada",), "seen", "shut")
    )
    assert (memory.latched, memory.strategy, memory.acted, memory.state, memory.waiting) == (None, "", "", "shut", ())


def restarted(memory: Memory, vessel: Vessel | None = None, **rest: Any) -> World:
    return World(memory=memory, vessel=vessel or Vessel(F_sp=0.03), **rest)


@pytest.mark.parametrize("goes_on", [True, False])
def test_a_simulated_plant_goes_on_in_its_mode_and_a_real_one_stands_in_observe(goes_on: bool) -> None:
    world = restarted(remembered(ModeEntered("approve", "Ada"), StateEntered("running")), goes_on=goes_on)
    world.tick()
    assert world.guard.mode is (Mode.APPROVE if goes_on else Mode.OBSERVE)


def test_a_fallback_with_an_open_intention_is_sent_until_it_stands_whatever_the_mode() -> None:
    world = restarted(remembered(ModeEntered("closed-loop", ""), FALLBACK), goes_on=False)
    world.tick(4)
    assert world.sent == [DRAIN.actions.commands] and world.guard.latched is not None
    assert len(world.journal.of(FallbackStands)) == 1 and world.vessel.given_back == 1
    assert world.journal.of(WriteIntended)[0].write == 5


def test_a_fallback_waits_for_no_reading_for_ever() -> None:
    world = restarted(remembered(FALLBACK), settings=GuardSettings(again_s=10.0, sync_s=5.0))
    world.silent(5)
    assert world.sent == []
    world.silent(8)
    assert world.sent[0] == DRAIN.actions.commands
    world.tick(4)
    assert world.journal.of(FallbackStands) and world.guard._latch.standing


def test_a_fallback_that_is_read_to_stand_is_not_sent_again() -> None:
    vessel = Vessel(X_cmd=0.0, F_sp=0.0, V_man=1.0)
    world = restarted(remembered(FALLBACK), vessel)
    world.tick(20)
    assert world.sent == [] and world.guard.latched is not None and world.seen[-1].state == "shut"
    assert [e.write for e in world.journal.of(ReadBack)] == [4]


def test_a_late_write_that_was_not_put_right_has_the_fallback_act() -> None:
    memory = remembered(FALLBACK, ReadBack(4, ("X.cmd",)), intended(5, Cause.FALLBACK, PUT_RIGHT))
    world = restarted(memory)
    world.tick(3)
    assert world.sent == [DRAIN.actions.commands]


def test_a_request_that_was_carried_out_goes_on_with_its_later_steps() -> None:
    vessel = Vessel(T_sp=305.0, F_sp=0.02)
    world = restarted(remembered(StateEntered("running"), REQUEST), vessel)
    world.tick(2)
    assert world.sent == []
    world.tick(2, L=9.5)
    assert world.sent == [POUR[1]]


def test_half_a_request_is_an_alarm() -> None:
    world = restarted(remembered(StateEntered("running"), REQUEST), Vessel(T_sp=305.0))
    world.tick(3)
    assert world.sent == []
    assert "not F.sp" in next(e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "write:half")


def test_what_was_owed_is_sent_and_what_is_waiting_is_taken_from_the_nominal_sequence() -> None:
    step = intended(2, Cause.SEQUENCE, "start", commands=(Command("F.sp", 0.03, 0.005),))
    world = restarted(remembered(step, StepTaken("start", "running")), Vessel())
    world.tick(2)
    assert world.sent == [(Command("F.sp", 0.03, 0.005),)] and world.seen[-1].state == "running"
    world = restarted(remembered(step), Vessel())
    world.tick(2)
    assert world.sent == [(Command("F.sp", 0.03, 0.005),)] and world.seen[-1].state == "running"


def test_a_sequence_that_the_tables_do_not_know_any_more_is_an_alarm() -> None:
    unknown = SequenceLoaded("r1", "running", (StepLoaded("gone", ()),), False)
    for memory in (remembered(unknown), remembered(StateEntered("nowhere"))):
        world = restarted(memory)
        world.tick(3, L=9.5)
        assert "sequence" in world.alarms and world.sent == [] and world.seen[-1].way is None


def test_requests_and_orders_are_used_once_over_a_restart() -> None:
    memory = remembered(StateEntered("running"), RequestAnswered("r1", "search", "", "authorised"))
    world = restarted(memory)
    world.ask()
    world.tick(2)
    assert world.seen[0].answers[0].finding is not None
    assert world.seen[0].answers[0].finding.criterion == "CHK-USED" and world.sent == []


def step(number: int, name: str = "empty", attempt: int = 1) -> WriteIntended:
    return intended(number, Cause.SEQUENCE, name, attempt, state="emptying")


TWICE = SequenceLoaded("r1", "running", (StepLoaded("empty", ()), StepLoaded("end", ())), False)


def test_only_what_was_given_up_is_given_up() -> None:
    for result in (WriteResult.ACCEPTED, WriteResult.FAILED, WriteResult.TIMED_OUT):
        memory = remembered(REQUEST, WriteEnded(3, 1, result), ReadBack(3, TAGS))
        assert memory.waiting == (POUR,) and memory.released and not memory.open
    memory = remembered(REQUEST, GIVEN_UP, step(4))
    assert memory.open[3].given_up and not memory.open[4].given_up
    assert remembered(REQUEST, ReadBack(3, TAGS), GIVEN_UP).open == {}
    assert remembered(GIVEN_UP) == remembered(ReadBack(3, TAGS)) == Memory(), "their intention was not journalled"


def test_a_request_that_was_answered_with_a_no_is_given_up() -> None:
    loaded = SequenceLoaded("r1", "running", STEPS, False)
    before = SequenceLoaded("r0", "running", (StepLoaded("end", ()),), False)
    for status in ("failed", "withdrawn"):
        no = RequestAnswered("r1", "search", "", status)
        assert remembered(before, REQUEST, no).waiting == (("end", ()),), "the plant has not got it"
        assert remembered(REQUEST, no).open[3].given_up
        memory = remembered(REQUEST, loaded, no)
        assert memory.waiting == () and memory.open[3].given_up
        for other in (
            remembered(REQUEST, loaded, RequestAnswered("r2", "search", "", status)),
            remembered(intended(3, Cause.SEQUENCE, "r1", steps=STEPS), loaded, no),
        ):
            assert other.waiting == (POUR,) and not other.open[3].given_up
        assert remembered(no) == Memory()
    for status in ("authorised", "verified", "accepted", "confirmed", "refused"):
        memory = remembered(REQUEST, loaded, RequestAnswered("r1", "search", "", status))
        assert memory.waiting == (POUR,) and not memory.open[3].given_up


def test_behind_a_request_nothing_follows_that_the_plant_was_read_not_to_hold_until_it_does() -> None:
    loaded, missed = SequenceLoaded("r1", "running", STEPS, False), ReadBack(3, (), TAGS)
    assert remembered(REQUEST, loaded, missed).waiting == ()
    again = intended(3, Cause.REQUEST, "r1", attempt=2, steps=STEPS)
    assert remembered(REQUEST, loaded, missed, again).waiting == ()
    assert remembered(REQUEST, loaded, missed, again, ReadBack(3, TAGS)).waiting == (POUR,)
    assert remembered(SequenceLoaded("r0", "running", STEPS, False), REQUEST, missed).waiting == (POUR,)
    start = intended(3, Cause.PERSON, "Ada", steps=STEPS)
    assert remembered(start, loaded, missed).waiting == (), "nor behind a start"
    later = SequenceLoaded("drain", "shut", STEPS, True)
    assert remembered(REQUEST, loaded, FALLBACK, later, missed).waiting == (POUR,)


def test_a_latch_ends_what_waited_before_it_though_no_fallback_could_be_sent() -> None:
    loaded = SequenceLoaded("r1", "running", STEPS, False)
    assert remembered(loaded, Latched("hot")).waiting == ()
    assert remembered(loaded, FALLBACK, SequenceLoaded("drain", "shut", STEPS, True), Latched("hot")).waiting == (POUR,)


def test_why_it_latched_is_remembered_however_often_the_fallback_is_sent() -> None:
    again = intended(4, Cause.FALLBACK, "drain", attempt=2)
    assert remembered(FALLBACK, Latched("hot"), again).latched == "hot"
    assert remembered(FALLBACK, FallbackActivated("drain", (), "hot"), again).latched == "hot"


def test_a_fallback_stands_by_its_own_write_only() -> None:
    put_right = intended(5, Cause.FALLBACK, PUT_RIGHT)
    for other in (put_right, step(5, "drain")):
        memory = remembered(FALLBACK, other, ReadBack(5, TAGS))
        assert (memory.strategy, memory.untold) == ("drain", "")
    memory = remembered(FALLBACK, ReadBack(4, ("X.cmd",)))
    assert (memory.strategy, memory.untold, memory.released) == ("", "drain", True)
    assert remembered(FALLBACK, ReadBack(4, ("X.cmd",)), FallbackStands("drain")).untold == ""
    later = SequenceLoaded("drain", "shut", STEPS, True)
    memory = remembered(FALLBACK, later, FallbackStands("drain"), put_right, ReadBack(5, TAGS))
    assert memory.waiting == (POUR,) and memory.state == "shut"


def test_a_step_is_taken_once_whoever_says_so() -> None:
    end = (("end", ()),)
    assert remembered(TWICE, step(2), ReadBack(2, TAGS)).waiting == end
    assert remembered(TWICE, step(2), StepTaken("empty", "emptying"), ReadBack(2, TAGS)).waiting == end
    same = SequenceLoaded("r1", "running", (StepLoaded("empty", ()), StepLoaded("empty", ())), False)
    taken = StepTaken("empty", "emptying")
    assert remembered(same, step(2), taken, ReadBack(2, TAGS)).waiting == (("empty", ()),)
    assert remembered(TWICE, StepTaken("start", "running")).waiting == (("empty", ()), *end)


def test_a_step_counts_as_taken_by_its_own_write_only() -> None:
    taken = StepTaken("empty", "emptying")
    assert remembered(step(2), taken).open[2].taken
    assert not remembered(step(2, "start"), taken).open[2].taken
    assert not remembered(intended(2, Cause.REQUEST, "empty"), taken).open[2].taken
    assert not remembered(step(2), taken, step(3)).open[3].taken
    assert remembered(step(2), taken, step(2, attempt=2)).open[2].taken
    assert not remembered(step(2), step(2, attempt=2)).open[2].taken


def test_a_step_that_was_given_up_is_owed_to_nobody() -> None:
    taken, missed = StepTaken("empty", "emptying"), ReadBack(2, (), TAGS)
    assert remembered(step(2), taken, missed).owed is not None
    assert remembered(step(2), taken, WriteEnded(2, 1, WriteResult.GIVEN_UP), missed).owed is None
    assert remembered(intended(2, Cause.PERSON, "Ada"), SequenceLoaded("", "running", (), False), missed).owed is None


def test_only_a_fallback_that_has_acted_is_spent() -> None:
    assert remembered(FallbackIneffective("drain", "LIM-HOT", "no", True)).spent == {"drain"}
    assert remembered(FallbackIneffective("drain", "LIM-HOT", "no", False)).spent == frozenset()
