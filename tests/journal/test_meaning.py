"""A record that contradicts itself, though every byte of it is what was written."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import pytest

from homeostat.domain.events.guard import GuardStarted, RequestAnswered, StateEntered
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.recovery import Attempted, Diagnosed, LaterStep, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated, FallbackStands, Latched, LatchReset
from homeostat.domain.events.writes import Cause, ReadBack, StepLoaded, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.recovery import ActionSet, Command
from homeostat.journal import Event, Journal, Report, RunFinished, RunStarted, Setting, Summary
from homeostat.journal.chain import HAPPENED, HEADER
from homeostat.journal.memory import MemoryTrace
from homeostat.journal.verify.meaning import MOST
from homeostat.journal.verify.verify import verify
from homeostat.record.decode import EVENTS
from tests.journal.forgery import lines_of, rewrite

pytestmark = pytest.mark.quick

ORDER = (Command("V2.man", 0.4, None), Command("F1.sp", None, 0.01))
ACTIONS = ActionSet(ORDER, "reduced_load")
DIGEST = ACTIONS.digest
CLOSE = (Command("V1.man", 0.0, None),)


def intended(write: int = 1, attempt: int = 1, cause: Cause = Cause.REQUEST, source: str = "r1") -> WriteIntended:
    own = DIGEST if cause is Cause.REQUEST else ""
    return WriteIntended(write, attempt, cause, source, ORDER if own else CLOSE, own, "reduced_load")


def ended(write: int = 1, attempt: int = 1, result: WriteResult = WriteResult.ACCEPTED) -> WriteEnded:
    return WriteEnded(write, attempt, result)


def answered(status: str, request: str = "r1", digest: str = DIGEST) -> RequestAnswered:
    return RequestAnswered(request, "search", digest, status)


DONE = Summary(1, "done")
STARTED = GuardStarted("cstr", "c0ffee", "closed-loop", "plant", False)
ACCEPTED = tuple(map(answered, ("received", "authorised", "verified", "accepted")))
READ = ReadBack(1, ("V2.man", "F1.sp"))
FELL = FallbackActivated("close", CLOSE, "too hot")
LATCHED = Latched("too hot")
FALLBACK = intended(2, cause=Cause.FALLBACK, source="close")
SEQUENCE = intended(3, cause=Cause.SEQUENCE, source="t1")
WROTE = (STARTED, *ACCEPTED, intended(), ended(), READ, answered("confirmed"))
OBSERVING = (STARTED, ModeEntered("observe", "kim"))
RELEASED = ReleasedActions.of("search", ACTIONS, 0.5)
RETRIED = (intended(), ended(result=WriteResult.TIMED_OUT), intended(attempt=2), ended(attempt=2), READ)


def record(directory: Path, *events: Event, summary: Summary | None = None) -> Report:
    """The report on a run of ``events``, one per second, that ends with its outcome."""
    summary = summary or DONE
    finished = () if any(isinstance(e, RunFinished) for e in events) else (RunFinished(summary.outcome),)
    return closed(directory, *events, *finished, summary=summary)


def closed(directory: Path, *events: Event, summary: Summary = DONE) -> Report:
    """The report on a journal of ``events``, one per second, and nothing else."""
    with Journal(directory) as journal:
        for number, event in enumerate(events):
            journal.record(event, float(number))
        journal.close(summary)
    return verify(directory)


@pytest.mark.parametrize(
    "events",
    [
        WROTE,
        (STARTED, *ACCEPTED, *RETRIED, answered("confirmed")),
        (STARTED, *map(answered, ("received", "authorised", "verified", "offered", "verified", "accepted"))),
        (STARTED, answered("received"), answered("refused"), answered("received", "r2"), answered("withdrawn", "r2")),
        (STARTED, *ACCEPTED, intended(), LATCHED, FALLBACK, FELL, ended(result=WriteResult.GIVEN_UP), ended(2),
         ReadBack(2, ("V1.man",)), FallbackStands("close"), SEQUENCE, ended(3), answered("withdrawn")),
        (STARTED, LATCHED, FELL, LatchReset(("kim",), "repaired", "held"), *WROTE[1:]),
        (STARTED, *ACCEPTED, intended(), replace(STARTED, restored=True), READ, intended(attempt=2), ended(attempt=2)),
        (STARTED, FELL, FALLBACK, replace(STARTED, restored=True, mode="observe"), replace(FALLBACK, attempt=2)),
        (STARTED, *map(answered, ("authorised", "offered", "verified", "accepted")), intended(), ended(), READ),
        (*WROTE, answered("refused", digest=""), *ACCEPTED[1:], intended(2), ended(2)),
        (STARTED, ModeEntered("observe", "kim"), ModeEntered("CLOSED_LOOP", "kim"), *WROTE[1:]),
    ],
)  # fmt: skip
def test_what_may_happen_is_no_contradiction(tmp_path: Path, events: tuple[Event, ...]) -> None:
    report = record(tmp_path, *events)
    assert report.complete and report.contradictions == ()


@pytest.mark.parametrize(
    ("events", "words"),
    [
        ((STARTED, ended()), "line 2: attempt 1 at write 1 ended, and was never intended"),
        ((*WROTE, ended()), "line 10: attempt 1 at write 1 ended twice"),
        ((*WROTE, ended(attempt=2)), "line 10: attempt 2 at write 1 ended, and was never intended"),
        ((STARTED, READ), "line 2: write 1 was read back, and never intended"),
        ((STARTED, *ACCEPTED, intended(), READ), "line 7: write 1 was read back before its attempt 1 had ended"),
        ((STARTED, *ACCEPTED, intended(attempt=2)), "line 6: attempt 2 at write 1 follows attempt 0"),
        ((STARTED, *ACCEPTED, intended(), ended(), intended()), "line 8: attempt 1 at write 1 follows attempt 1"),
        ((STARTED, *ACCEPTED, intended(), SEQUENCE), "line 7: write 3 was intended while write 1 was in flight"),
        ((STARTED, intended()), "line 2: something was sent for request 'r1', which nobody had made"),
        ((STARTED, *ACCEPTED, answered("withdrawn"), intended()),
         "line 7: something was sent for request 'r1' after it was withdrawn"),
        ((STARTED, answered("received"), answered("refused"), intended()), "after it was refused"),
        ((STARTED, *ACCEPTED, replace(intended(), digest="beef")), "line 6: digest beef was sent for request 'r1' of"),
        ((STARTED, *ACCEPTED, answered("accepted", digest="beef")), "line 6: request 'r1' has digest beef, before it"),
        ((*WROTE, answered("failed")), "line 10: request 'r1' is 'failed' after 'confirmed'"),
        ((STARTED, answered("accepted")), "line 2: request 'r1' is 'accepted' after 'nothing'"),
        ((STARTED, answered("received"), answered("confirmed")), "request 'r1' is 'confirmed' after 'received'"),
        ((STARTED, *ACCEPTED, answered("verified")), "line 6: request 'r1' is 'verified' after 'accepted'"),
        ((STARTED, answered("blessed")), "line 2: request 'r1' is 'blessed', which is no status"),
        ((STARTED, *ACCEPTED, answered("confirmed")),
         "line 5: request 'r1' was accepted, and nothing was ever sent for it"),
        ((STARTED, *ACCEPTED, intended(), ended(), replace(READ, deviating=("F1.sp",)), answered("confirmed")),
         "line 9: request 'r1' is confirmed, and no read-back says so"),
        ((*OBSERVING, FALLBACK), "line 3: a fallback was written in mode 'observe', in which nobody writes"),
        ((*OBSERVING, replace(SEQUENCE, cause=Cause.PERSON)), "line 3: a person was written in mode 'observe'"),
        ((replace(STARTED, mode="advise"), *WROTE[1:]), "line 6: a request was written in mode 'advise'"),
        ((STARTED, LATCHED, FELL, *WROTE[1:]), "line 8: a request was written after the latch of line 2 without a"),
        ((STARTED, LATCHED, SEQUENCE), "line 3: a step was written after the latch of line 2 without a fallback"),
        ((FELL, RunFinished("recovered")), "line 2: the run ended 'recovered', but a fallback acted in line 1"),
        ((FELL, RunFinished("no_action")), "line 2: the run ended 'no-action', but a fallback acted in line 1"),
        ((STARTED, RunFinished("fallback")), "line 2: the run ended 'fallback', but no fallback acted"),
    ],
)  # fmt: skip
def test_what_may_not_happen_is_said_with_its_line(tmp_path: Path, events: tuple[Event, ...], words: str) -> None:
    finished = [e for e in events if isinstance(e, RunFinished)]
    report = record(tmp_path, *events, summary=Summary(1, finished[0].outcome) if finished else None)
    assert not report.complete and not report.intact and report.problem == report.contradictions[0]
    assert any(words in sentence for sentence in report.contradictions), report.contradictions


def test_a_manifest_that_contradicts_the_last_word_is_found(tmp_path: Path) -> None:
    report = record(tmp_path, STARTED, RunFinished("recovered"), summary=Summary(1, "no_action"))
    assert report.contradictions == ("line 2: the run ended 'recovered', by the manifest 'no-action'",)


@pytest.mark.parametrize(
    "first", [STARTED, RunStarted("cstr", (), 1, (Setting("end_s", 1.0), Setting("configuration", "c0ffee")))]
)
def test_the_configuration_of_the_run_is_the_manifests(tmp_path: Path, first: Event) -> None:
    assert record(tmp_path / "same", first, summary=Summary(1, "done", "c0ffee")).complete
    assert record(tmp_path / "none", first).complete
    report = record(tmp_path / "other", first, summary=Summary(1, "done", "beef"))
    assert report.contradictions == ("line 1: it ran with configuration c0ffee, by the manifest with beef",)


STEP = LaterStep("t2", "B1.level >= 0.2", "held", CLOSE)


def test_the_digest_of_a_release_is_that_of_all_it_holds(tmp_path: Path) -> None:
    assert record(tmp_path / "right", RELEASED).complete
    for number, altered in enumerate(
        (
            replace(RELEASED, commands=CLOSE),
            replace(RELEASED, state="held"),
            replace(RELEASED, then=(STEP,)),
            replace(RELEASED, commands=ORDER[::-1]),
            replace(RELEASED, commands=(replace(ORDER[0], rate=1.0), ORDER[1])),
        )
    ):
        report = record(tmp_path / str(number), altered)
        words = f"line 1: digest {DIGEST[:12]} is not that of the commands and steps that it stands for"
        assert report.contradictions[0] == words
    assert record(tmp_path / "older", replace(RELEASED, commands=CLOSE, state="")).complete


def test_a_digest_stands_for_the_same_commands_everywhere(tmp_path: Path) -> None:
    other = replace(intended(cause=Cause.FALLBACK), digest=DIGEST)
    words = f"line 3: digest {DIGEST[:12]}"
    report = record(tmp_path / "whole", STARTED, RELEASED, other)
    assert report.contradictions[:2] == (
        f"{words} is not that of the commands and steps that it stands for",
        f"{words} stands for other commands than in line 2",
    )
    report = record(tmp_path / "part", STARTED, RELEASED, replace(other, steps=(StepLoaded("t2", CLOSE),)))
    assert report.contradictions[0] == f"{words} stands for other commands than in line 2"


def test_times_that_go_back_are_found(tmp_path: Path) -> None:
    record(tmp_path, *WROTE)
    lines = lines_of(tmp_path)
    lines[3]["at_s"], lines[4]["at_s"] = 99999.0, -5.0
    lines[2] = {**dict(list(lines[2].items())[:4]), "happened_s": 77.0, **dict(list(lines[2].items())[4:])}
    rewrite(tmp_path, lines)
    found = verify(tmp_path).contradictions
    assert "line 5: its time is -5 s, after a line of 99999 s; times never decrease" in found
    assert "line 3: it happened at 77 s, after its line of 2 s" in found


def test_a_record_full_of_contradictions_is_told_in_part(tmp_path: Path) -> None:
    assert len(record(tmp_path, *(ended(n) for n in range(3 * MOST))).contradictions) == MOST


RUN = (
    RunStarted("cstr", ("leak",), 7, (Setting("end_s", 10.0),)),
    StateEntered("normal"),
    Diagnosed((), ()),
    Attempted(1, "search", ("normal",), ORDER, DIGEST, True, (), 4),
    RELEASED,
    StateEntered("reduced_load"),
    RunFinished("recovered"),
)
RESULT = {
    "case": "cstr", "seed": 7, "outcome": "recovered", "onset_s": 1.5, "detected_s": 2.0, "released_s": 4.0,
    "attempts": 1, "state": "reduced_load", "schema": 2,
    "actions": [{"tag": c.tag, "value": c.value, "rate": c.rate} for c in ORDER],
}  # fmt: skip


def with_result(directory: Path, change: Callable[[dict[str, object]], object]) -> Report:
    content: dict[str, object] = dict(RESULT)
    change(content)
    directory.mkdir()
    (directory / "result.json").write_text(json.dumps(content))
    return record(directory, *RUN, summary=Summary(7, "recovered"))


def test_a_result_that_says_what_the_journal_says(tmp_path: Path) -> None:
    assert with_result(tmp_path / "run", lambda result: None).complete


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("case", "mixing_module"), ("seed", 8), ("outcome", "no_action"), ("detected_s", None), ("detected_s", 3.0),
        ("onset_s", 3.0), ("released_s", None), ("released_s", 5.0), ("attempts", 2), ("state", "normal"),
        ("actions", [{"tag": "V2.man", "value": 0.4, "rate": None}]),
    ],
)  # fmt: skip
def test_a_result_that_contradicts_the_journal_is_found(tmp_path: Path, name: str, value: object) -> None:
    report = with_result(tmp_path / "run", lambda result: result.update({name: value}))
    assert not report.complete and report.problem and report.problem.startswith("the result")


UNTOLD = (*RUN[:4], STARTED, *ACCEPTED, intended(), ended(), READ, answered("confirmed"), *RUN[5:])
"""A run whose release only the guard tells: recovery was overtaken."""


@pytest.mark.parametrize(
    ("events", "released_s", "agrees"),
    [
        (UNTOLD, 9.0, True), (UNTOLD, 12.0, True), (UNTOLD, 11.0, False), (UNTOLD, None, False),
        ((*RUN[:4], *RUN[5:]), None, True), ((UNTOLD[0], *UNTOLD[4:13], *UNTOLD[1:4], *UNTOLD[13:]), None, True),
    ],
    ids=["when it was sent", "when it stood", "else", "never", "nothing was sent", "a step as usual"],
)  # fmt: skip
def test_a_release_is_what_the_guard_has_written(
    tmp_path: Path, events: tuple[Event, ...], released_s: float | None, agrees: bool
) -> None:
    content = {"case": "cstr", "released_s": released_s, "actions": RESULT["actions"] if released_s else []}
    (tmp_path / "result.json").write_text(json.dumps(content))
    report = record(tmp_path, *events, summary=Summary(7, "recovered"))
    assert report.complete == agrees, report.contradictions
    assert agrees or report.contradictions[0].startswith("the result's 'released_s' is")


def test_every_event_of_the_guard_can_be_kept(tmp_path: Path) -> None:
    memory = MemoryTrace()
    for event in (*WROTE, FELL, LATCHED, FALLBACK, SEQUENCE, *RETRIED):
        memory.record(event, 0.0)
    assert {r.fields.get("cause") for r in memory.records()} >= {"REQUEST", "FALLBACK", "SEQUENCE"}


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: str(event.kind))
def test_no_field_of_an_event_has_a_name_that_every_line_has(event: type[Event]) -> None:
    assert is_dataclass(event) and {field.name for field in fields(event)} & {*HEADER, HAPPENED} == set()
