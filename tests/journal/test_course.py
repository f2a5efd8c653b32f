"""A record whose story no guard and no run could leave: gaps, agreement, confirmation, beginning and end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import StateEntered, Stopped
from homeostat.domain.events.people import AlarmRaised, AlarmReturned, ModeEntered, PersonHeard, ServiceChanged
from homeostat.domain.events.trips import FallbackStands
from homeostat.domain.events.writes import Cause, ReadBack
from homeostat.domain.mode import Role
from homeostat.journal import Event, Journal, Resumed, RunFinished
from homeostat.journal.verify.verify import verify
from tests.journal.test_meaning import (
    ACCEPTED,
    DONE,
    FALLBACK,
    FELL,
    LATCHED,
    READ,
    RELEASED,
    RUN,
    SEQUENCE,
    STARTED,
    WROTE,
    answered,
    closed,
    ended,
    intended,
    record,
)

FAILED = AlarmRaised("journal", "the journal failed: no space left", Priority.HIGH)
WORKS = AlarmReturned("journal")
LOST = (ended(4), intended(5, 2, Cause.SEQUENCE), ReadBack(1, ("V2.man",)))


@pytest.mark.parametrize(
    ("events", "excused"),
    [
        ((STARTED, FAILED, *LOST), True),
        ((STARTED, FAILED, *LOST, WORKS), True),
        ((STARTED, FAILED, WORKS, *LOST), True),
        ((STARTED, FAILED, WORKS, SEQUENCE, *LOST), False),
        ((STARTED, *LOST, FAILED, WORKS), False),
        ((STARTED, *LOST), False),
        ((FAILED, STARTED, *LOST), False),
        ((STARTED, replace(FAILED, alarm="recovery:journal"), *LOST), False),
        ((STARTED, replace(FAILED, cause="x"), *LOST), False),
        ((STARTED, WORKS, *LOST), False),
        ((STARTED, FAILED, replace(STARTED, restored=True), SEQUENCE, *LOST), False),
        ((STARTED, FAILED, WORKS, answered("confirmed")), True),
        ((STARTED, FAILED, WORKS, *(SEQUENCE, ended(3)), intended(9), ended(9)), True),
    ],
)  # fmt: skip
def test_the_guards_alarm_of_its_journal_excuses_what_happened_while_it_stood(
    tmp_path: Path, events: tuple[Event, ...], excused: bool
) -> None:
    """And what a gap left open: the next new write, and the requests of the ten minutes after it, are known again."""
    assert record(tmp_path, *events).complete is excused


def test_requests_are_asked_again_some_time_after_a_gap(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        for event, at_s in ((STARTED, 0.0), (FAILED, 1.0), (WORKS, 2.0), (answered("confirmed"), 603.0)):
            journal.record(event, at_s)
        journal.record(RunFinished("done"), 700.0)
        journal.close(DONE)
    assert verify(tmp_path).contradictions[0] == "line 4: request 'r1' is 'confirmed' after 'nothing'"


def test_nothing_is_accepted_while_the_guards_journal_does_not_work(tmp_path: Path) -> None:
    words = "request 'r1' was accepted while the journal did not work"
    for number, events in enumerate(((STARTED, FAILED, *WROTE[1:]), (STARTED, FAILED, *WROTE[1:], WORKS))):
        assert record(tmp_path / str(number), *events).contradictions == (f"line 6: {words}",)
    with Journal(tmp_path / "tick") as journal:  # the tick that ends the alarm may accept something
        for event, at_s in ((STARTED, 0.0), (FAILED, 1.0), *((e, 2.0) for e in ACCEPTED), (WORKS, 2.0)):
            journal.record(event, at_s)
        journal.record(RunFinished("done"), 3.0)
        journal.close(DONE)
    assert verify(tmp_path / "tick").complete


APPROVING = replace(STARTED, mode="approve")
OFFERED = tuple(map(answered, ("authorised", "offered")))
YES = PersonHeard("o1", "kim", Role.OPERATOR, "approve", "r1", True)
TAKEN = tuple(map(answered, ("verified", "accepted")))
SENT = (intended(), ended(), READ, answered("confirmed"))


def test_in_approve_a_request_is_accepted_once_a_person_has_said_yes_to_what_was_offered(tmp_path: Path) -> None:
    assert record(tmp_path / "yes", APPROVING, *OFFERED, YES, *TAKEN, *SENT).complete
    words = "request 'r1' is accepted in mode 'approve', and"
    for number, (events, why) in enumerate([
        ((*OFFERED[:1], *TAKEN), "it was offered to nobody"), ((*OFFERED[:1], YES, *TAKEN), "it was offered to nobody"),
        ((*OFFERED, *TAKEN), "nobody said yes to it"), ((YES, *OFFERED, *TAKEN), "nobody said yes to it"),
        ((*OFFERED, replace(YES, done=False), *TAKEN), "nobody said yes to it"),
        ((*OFFERED, replace(YES, subject="r2"), *TAKEN), "nobody said yes to it"),
        ((*OFFERED, replace(YES, verb="reject"), *TAKEN), "nobody said yes to it"),
    ]):  # fmt: skip
        report = record(tmp_path / str(number), APPROVING, *events)
        assert any(f"{words} {why}" in sentence for sentence in report.contradictions), (number, report)
    entered = record(tmp_path / "entered", STARTED, ModeEntered("approve", "kim"), *OFFERED, *TAKEN, *SENT)
    assert "nobody said yes to it" in entered.contradictions[0]


@pytest.mark.parametrize(
    ("events", "words"),
    [
        ((STARTED, Stopped("enough"), *WROTE[1:]), "line 7: a request was written after the guard was stopped in line"),
        ((STARTED, Stopped("enough"), FALLBACK), "line 3: a fallback was written after the guard was stopped in line"),
        ((ModeEntered("closed-loop", ""), *WROTE), "line 1: 'mode-entered' comes from a guard, and none had started"),
        (WROTE[1:], "line 1: 'request-answered' comes from a guard, and none had started"),
        ((replace(STARTED, mode=""),), "line 1: '' is no mode"),
        ((STARTED, ModeEntered("automatic", "kim")), "line 2: 'automatic' is no mode"),
        ((STARTED, *ACCEPTED[:3], intended()), "line 5: something was sent for request 'r1' before it was accepted"),
        ((*WROTE[:-2], ReadBack(1, ()), answered("confirmed")), "'r1' is confirmed, and no read-back says so"),
        ((*WROTE[:-2], ReadBack(1, ("V2.man",)), answered("confirmed")), "'r1' is confirmed, and no read-back says so"),
        ((STARTED, FALLBACK, FELL, ended(2), ReadBack(2, ()), FallbackStands("close")),
         "line 6: fallback 'close' stands, and no read-back says so"),
        ((STARTED, FALLBACK, FELL, ended(2), ReadBack(2, ("V1.man",)), FallbackStands("open")),
         "line 6: fallback 'open' stands, and no read-back says so"),
        ((STARTED, replace(SEQUENCE, cause=Cause.PERSON, source="kim")),
         "line 2: this was written on behalf of 'kim', who ordered no start"),
        ((STARTED, RELEASED), "is said to be released, and no request of it is confirmed"),
        ((STARTED, RunFinished("done"), StateEntered("normal")),
         "line 3: 'state-entered' comes after the run had ended in line 2"),
        ((STARTED, RunFinished("done"), RunFinished("done")),
         "line 3: 'run-finished' comes after the run had ended in line 2"),
    ],
)  # fmt: skip
def test_what_no_guard_does_is_said(tmp_path: Path, events: tuple[Event, ...], words: str) -> None:
    report = record(tmp_path, *events)
    assert not report.complete and any(words in sentence for sentence in report.contradictions), report.contradictions


@pytest.mark.parametrize(
    "events",
    [
        (STARTED, Stopped("enough"), replace(STARTED, restored=True), *WROTE[1:]),
        (*WROTE[:-2], ServiceChanged("F1.sp", False, "", "moved"), ReadBack(1, ("V2.man",)), answered("confirmed")),
        (*WROTE[:-2], ReadBack(1, ("V2.man",), ("F1.sp",)), intended(attempt=2), ended(attempt=2), *WROTE[-2:]),
        (STARTED, replace(SEQUENCE, cause=Cause.PERSON, source="kim"), ended(3),
         PersonHeard("o1", "kim", Role.ENGINEER, "start", "t1", True)),
        (*WROTE, RELEASED),
    ],
)  # fmt: skip
def test_what_a_guard_does_is_no_contradiction(tmp_path: Path, events: tuple[Event, ...]) -> None:
    assert record(tmp_path, *events).contradictions == ()


@pytest.mark.parametrize("said", [True, False])
def test_what_was_confirmed_is_said_to_be_released(tmp_path: Path, said: bool) -> None:
    with Journal(tmp_path) as journal:
        for number, event in enumerate((*WROTE, *([RELEASED] if said else []))):
            journal.record(event, float(number))
        journal.record(RunFinished("done"), 60.0)
        journal.close(DONE)
    words = () if said else ("line 9: request 'r1' is confirmed, and nobody says that it was released",)
    assert verify(tmp_path).contradictions == words


@pytest.mark.parametrize("between", [LATCHED, ModeEntered("observe", "kim"), replace(STARTED, restored=True)])
def test_what_comes_between_may_keep_recovery_from_saying_so(tmp_path: Path, between: Event) -> None:
    with Journal(tmp_path) as journal:
        for number, event in enumerate((*WROTE, between)):
            journal.record(event, float(number))
        journal.record(RunFinished("done"), 60.0)
        journal.close(DONE)
    assert verify(tmp_path).complete


def test_a_run_that_was_closed_says_how_it_ended(tmp_path: Path) -> None:
    words = ("the run was closed, and no line says how it ended ('run-finished' is missing)",)
    assert closed(tmp_path / "guard", *WROTE).contradictions == words
    assert closed(tmp_path / "run", RUN[0]).contradictions == words
    assert closed(tmp_path / "resumed", RUN[0], RunFinished("done"), Resumed(2, 0, False), RunFinished("done")).complete
