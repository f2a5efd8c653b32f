"""What was released is what the guard has begun to write for a request, whatever recovery had time to say of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.recovery import Attempted, Diagnosed, ReleasedActions
from homeostat.domain.events.writes import Cause, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.domain.outcome import Outcome
from homeostat.domain.recovery import Command
from homeostat.domain.verdict import Finding, Owner
from homeostat.evaluate.operation import Operation, Thinking
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.recorded.run import record_run
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import Event, MemoryTrace
from homeostat.journal.verify.verify import verify
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import Workbench, in_operation
from homeostat.record.directory import RunDirectory
from homeostat.record.releases import Release, Releases
from homeostat.record.result import read_result
from homeostat.record.run_record import RunRecord

FAULT, END_S = "stuck_closed_VI202", 110.0
"""A fault that the search answers within this time [s]."""
ORDER = (Command("F.sp", 0.02, 0.005),)
FINDINGS = tuple(
    Finding(name, Owner.PLANNING, margin, "K", 0.0, 0, "") for name, margin in (("ACC-A", 0.3), ("ACC-B", 0.1))
)
APPROVED = Attempted(1, "search", ("running", "reduced"), ORDER, "d1", True, FINDINGS, 4)


def intended(source: str = "r1", cause: Cause = Cause.REQUEST, attempt: int = 1, digest: str = "d1") -> WriteIntended:
    return WriteIntended(1, attempt, cause, source, ORDER, digest, "reduced")


def answered(status: str, name: str = "r1", digest: str = "d1") -> RequestAnswered:
    return RequestAnswered(name, "search", digest, status)


def made(*events: Event) -> tuple[Release, ...]:
    """Releases of events that happen at 1 s, 2 s and so on."""
    releases = Releases()
    for number, event in enumerate(events, start=1):
        releases.take(event, float(number))
    return releases.made


ACCEPTED = (APPROVED, answered("authorised"), answered("accepted"))


def test_what_was_confirmed_is_a_release_of_the_time_at_which_the_plant_was_read_to_hold_it() -> None:
    (release,) = made(*ACCEPTED, intended(), intended(attempt=2), answered("confirmed"))
    assert release == Release(6.0, "search", "d1", ORDER, "reduced", APPROVED) and release.min_margin == 0.1


@pytest.mark.parametrize(
    "ended",
    [
        (), (WriteEnded(1, 1, WriteResult.FAILED),), (WriteEnded(1, 1, WriteResult.GIVEN_UP), answered("withdrawn")),
        (WriteEnded(1, 1, WriteResult.TIMED_OUT), answered("failed")), (intended("r1", attempt=2), answered("failed")),
    ],
)  # fmt: skip
def test_what_was_begun_is_a_release_whatever_became_of_it(ended: tuple[Event, ...]) -> None:
    (release,) = made(*ACCEPTED, intended(), *ended)
    assert (release.at_s, release.proposer, release.commands) == (4.0, "search", ORDER)


def test_what_releases_steps_for_later_alone_is_a_release() -> None:
    (release,) = made(*ACCEPTED, answered("confirmed"))
    assert (release.at_s, release.commands, release.target) == (4.0, (), "reduced")


@pytest.mark.parametrize("status", ["authorised", "offered", "advised", "refused", "withdrawn", "failed"])
def test_what_was_never_sent_is_none(status: str) -> None:
    assert made(APPROVED, answered("authorised"), answered(status)) == ()


@pytest.mark.parametrize("cause", [Cause.FALLBACK, Cause.SEQUENCE, Cause.PERSON])
def test_what_nobody_has_asked_for_is_none(cause: Cause) -> None:
    assert made(*ACCEPTED, intended("drain", cause)) == ()


def test_what_nobody_tells_is_left_open() -> None:
    (release,) = made(answered("authorised", digest="d2"), intended(digest="d2"))
    assert release.approved is None and release.min_margin is None and release.target == "reduced"


def test_where_every_step_is_asked_for_the_steps_before_a_diagnosis_count_for_nothing() -> None:
    usual = (answered("authorised", "r0", "d0"), intended("r0", digest="d0"))
    for stepwise, count in ((True, 1), (False, 2)):
        recorder = RunRecord(stepwise=stepwise)
        for at_s, event in enumerate(
            (*usual, Diagnosed((), ()), answered("confirmed", "r0", "d0"), *ACCEPTED, intended())
        ):
            recorder(event, float(at_s))
        assert len(recorder.released) == count and recorder.released[-1].digest == "d1"


def test_the_figure_marks_what_was_written() -> None:
    record = RunRecord()
    for at_s, event in enumerate((*ACCEPTED, intended(), answered("withdrawn"))):
        record(event, float(at_s))
    assert [(r.at_s, r.target, r.approved) for r in record.releases] == [(3.0, "reduced", APPROVED)]


# --- whole runs -------------------------------------------------------------------------------------------------


class Overtaking:
    """A person who orders something as soon as the first request is being written, or is answered so."""

    def __init__(self, status: str, verb: Verb, subject: str = "") -> None:
        """``status`` of the answer; empty for the intention to write."""
        self._status = status
        self._order: PersonCommand | None = PersonCommand(
            "order-1", "Ada", Role.ENGINEER, verb, subject, reason="as tested"
        )
        self._waiting: list[PersonCommand] = []
        self.events: list[Event] = []

    def __call__(self, event: Event, at_s: float) -> None:
        self.events.append(event)
        match event:
            case WriteIntended():
                come = not self._status and event.cause is Cause.REQUEST
            case RequestAnswered():
                come = event.status == self._status
            case _:
                come = False
        if come and self._order is not None:
            self._waiting, self._order = [self._order], None

    def orders(self) -> Iterator[PersonCommand]:
        given, self._waiting = self._waiting, []
        yield from given


def overtaken(person: Overtaking) -> Run:
    plant, trace = load_plant("mixing_module"), MemoryTrace()
    trace.subscribe(person)
    chosen = scenario(plant, FAULT, 1, end_s=END_S)
    return run(plant, chosen, trace, DeclaredClock(1.0), operation=Operation(orders=person.orders))


@pytest.mark.slow
def test_a_release_that_recovery_had_no_time_to_record_is_scored_all_the_same() -> None:
    person = Overtaking("", Verb.MODE, "observe")
    result = overtaken(person)
    assert not [e for e in person.events if isinstance(e, ReleasedActions)], "it was overtaken in the very tick"
    written = [e for e in person.events if isinstance(e, WriteIntended) and e.cause is Cause.REQUEST]
    assert result.outcome is not Outcome.NO_ACTION and result.actor == "search"
    assert result.released_s is not None and result.actions == written[0].commands and result.min_margin is not None


@pytest.mark.slow
def test_a_fallback_between_the_confirmation_and_the_record_leaves_both_in_the_score() -> None:
    result = overtaken(Overtaking("confirmed", Verb.FALL_BACK))
    assert result.outcome is Outcome.FALLBACK and result.actor == "fallback" and result.released_s is not None


class Leaving:
    """Planning that wants to end the process, or to be cancelled."""

    def __init__(self, raised: type[BaseException]) -> None:
        self._raised = raised

    async def plan(self, situation: Any, advice: Any) -> Any:
        raise self._raised(0)


@pytest.mark.slow
@pytest.mark.parametrize("raised", [SystemExit, pytest.param(KeyboardInterrupt, marks=pytest.mark.wide)])
def test_a_proposer_that_ends_the_process_ends_no_run(raised: type[BaseException], tmp_path: Path) -> None:
    def propose(bench: Workbench) -> Any:
        return tuple(replace(p, planning=Leaving(raised)) for p in in_operation(bench))

    plant, seen = load_plant("mixing_module"), []
    chosen = scenario(plant, FAULT, 1, end_s=END_S)
    with RunDirectory(tmp_path / "run") as directory:
        done = record_run(
            plant, chosen, directory, Thinking(declared_s=1.0), "leaving", lambda event, at_s: seen.append(event),
            lambda snapshot: None, Proposing(propose=propose),
        )  # fmt: skip
    assert (result := read_result(tmp_path / "run")) is not None and result.outcome is done.outcome
    assert verify(tmp_path / "run").complete
    alarms = [e.alarm for e in seen if isinstance(e, AlarmRaised)]
    assert "recovery:failed" in alarms and "recovery:lost" in alarms
