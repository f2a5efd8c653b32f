"""Runs that begin with a playbook, add to it, and stay a function of their inputs; a playbook built offline."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from homeostat.agents.playbook.book import Book
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.recovery import Attempted, Compared, GaveUp, Probed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.playbook import Ending, Entry
from homeostat.domain.recovery import Command
from homeostat.evaluate.playbook.answering import answered
from homeostat.evaluate.playbook.building import Hands, Workplace, build, elsewhere, left_of
from homeostat.evaluate.playbook.points import Question, questions
from homeostat.evaluate.playbook.recoveries import entries_of
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.journal.memory import Entry as Line
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.recoveries import WATCHED_S, ending_of, recoveries
from homeostat.record.playbook import PlaybookError, add_to_playbook, read_playbook
from tests.twin.followed import reactor

FAULT, ONSET_S = "cool_stuck_closed", 900.0


def recovered(seed: int, book: Book | None, severity: float = 0.7, end_s: float = 960.0) -> Run:
    chosen = scenario(reactor(), FAULT, seed, ONSET_S, severity, end_s)
    return run(reactor(), chosen, MemoryTrace(), DeclaredClock(1.0), Proposing(playbook=book))


def book(*entries: Entry) -> Book:
    return Book(entries, reactor().description, "0" * 64)


@cache
def first() -> Run:
    """A run with an empty playbook, that is watched until recovery looks at its release again."""
    return recovered(1, book(), end_s=1515.0)


@cache
def second() -> Run:
    """Another reactor with a smaller fault, whose playbook has what the first one did."""
    return recovered(2, book(*entries_of(first())[:1]), 0.66)


def told(done: Run) -> list[tuple[float, object]]:
    return [(line.at_s, line.event) for line in done.record.entries]


# --- what a run adds ---------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_an_entry_says_what_was_seen_done_expected_and_came_of_it() -> None:
    entry = entries_of(first())[0]
    occasion, answer, after = entry.occasion, entry.answer, entry.aftermath
    assert (entry.configuration, occasion.state, occasion.mode) == (reactor().configuration, "normal", "closed-loop")
    assert {h.name for h in occasion.hypotheses} == {FAULT}
    stands = {s.tag: s.value for s in occasion.setpoints}
    assert stands["T1.sp"] == 310.0 and stands["V2.man"] is None, "as it stood before the release"
    released = first().record.of_kind(ReleasedActions)[0]
    assert answer is not None and answer.commands == released.commands and answer.path == ("normal", "reduced_load")
    assert answer.proposer == "search" and 0.2 < answer.cost_share < 0.6
    assert isinstance(answer.certificate, Certificate) and answer.certificate.violations == 0
    assert answer.worst is not None and answer.worst.criterion in ("ACC-T-HIGH", "LIM-T-HIGH")
    assert after is not None and (after.ending, after.seconds) == (Ending.HELD, WATCHED_S) and after.good
    assert after.kept is not None and after.kept > 0.0


def test_the_truth_of_a_run_is_not_in_its_entries() -> None:
    sizes = {f.severity for h in entries_of(first())[0].occasion.hypotheses for f in h.faults}
    assert sizes and 0.7 not in sizes, "what was diagnosed"


def line(at_s: float, event: object) -> Line:
    return Line(at_s, event)  # type: ignore[arg-type]


RELEASED = ReleasedActions("search", (), "", "normal", 0.0)
FELL = FallbackActivated("isolate", (), "too hot")


@pytest.mark.parametrize(
    ("later", "end_s", "expected"),
    [
        ((), 2000.0, (1600.0, Ending.HELD)),
        ((), 1100.0, (1100.0, Ending.CUT_SHORT)),
        ((line(1050.0, RELEASED), line(1060.0, RELEASED)), 2000.0, (1050.0, Ending.REPLACED)),
        ((line(1040.0, FELL), line(1060.0, RELEASED)), 2000.0, (1040.0, Ending.FELL_BACK)),
    ],
)
def test_what_ends_the_time_of_watching(later: tuple[Line, ...], end_s: float, expected: tuple[float, Ending]) -> None:
    assert ending_of(later, 1000.0, end_s, WATCHED_S) == expected


# --- a run that begins with one ----------------------------------------------------------------------------------


@pytest.mark.slow
def test_what_helped_before_is_proposed_first_judged_bettered_and_compared() -> None:
    attempts = second().record.attempts
    assert attempts[0].proposer == "playbook" and attempts[0].findings and attempts[0].approved
    known = entries_of(first())[0].answer
    assert known is not None and attempts[0].commands == known.commands
    assert any(a.proposer == "playbook" and a.polished for a in attempts), "with a smaller fault, more may be fed"
    (compared,) = second().record.of_kind(Compared)
    assert {"playbook", "search"} <= {a.proposer for a in compared.alternatives}
    released = second().record.of_kind(ReleasedActions)[0]
    assert released.digest == compared.chosen and released.certificate is not None, "checked today like anything else"


@pytest.mark.wide
def test_equal_inputs_with_an_equal_playbook_give_an_equal_run() -> None:
    again = recovered(2, book(*entries_of(first())[:1]), 0.66)
    assert told(again) == told(second())


@pytest.mark.slow
def test_an_empty_playbook_changes_nothing_that_is_released() -> None:
    without = recovered(1, None)
    released = [e.commands for e in without.record.of_kind(ReleasedActions)]
    assert released == [e.commands for e in first().record.of_kind(ReleasedActions)][:1]
    assert next(e.proposer for e in first().record.of_kind(GaveUp)) == "playbook"


@pytest.mark.slow
def test_a_forged_entry_is_judged_and_not_released() -> None:
    """Whoever can write the file can propose anything, and no more than that."""
    entry = entries_of(first())[0]
    assert entry.answer is not None
    full = tuple(replace(c, value=1 / 30) if c.tag == "F1.sp" else c for c in entry.answer.commands)
    outside = tuple(replace(c, value=400.0) if c.tag == "T1.sp" else c for c in entry.answer.commands)
    every = (full, outside, (Command("XV1.cmd", 0.0, None),))
    forged = [replace(entry, answer=replace(entry.answer, commands=commands)) for commands in every]
    done = recovered(1, book(*forged))
    tried = [a for a in done.record.attempts if a.proposer == "playbook"]
    assert len(tried) == 3 and not any(a.approved for a in tried)
    assert [r.proposer for r in done.record.of_kind(ReleasedActions)] == ["search"]


def test_what_the_journal_says_of_it() -> None:
    (setting,) = Proposing(playbook=book()).settings
    assert (setting.name, setting.value) == ("playbook", "0" * 64) and Proposing().settings == ()


# --- built offline -----------------------------------------------------------------------------------------------


def test_questions_are_over_faults_severities_and_states() -> None:
    asked = questions(reactor(), severities=2)
    assert len(asked) == 2 * len(reactor().description.faults) and {q.state for q in asked} == {"normal"}
    assert len({q.source for q in asked}) == len(asked) and {q.onset_s for q in asked} == {reactor().onset_s}
    sizes = [q.severity for q in asked if q.fault == "temp_bias"]
    assert sizes == pytest.approx([4.125, 11.375]), "the middles of both halves of 0.5 to 15 K"
    (nominal,) = questions(reactor(), [FAULT], severities=1)
    assert nominal.severity == 0.7


def test_the_states_of_a_batch_are_asked_about_in_their_middle() -> None:
    plant = load_plant("mixing_module")
    asked = questions(plant, ["sensor_bias_flow"], severities=3)
    assert len({q.state for q in asked}) >= 6 and "complete" not in {q.state for q in asked}
    assert {round(q.severity, 3) for q in asked} == {-0.333, 0.333}, "in the middle of the range nothing is wrong"


@pytest.mark.parametrize(
    ("faults", "states", "words"),
    [(["leek"], [], "no fault, 'leek'; did you mean 'leak'"), ([], ["reduced_load"], "'reduced_load'; it has normal")],
)
def test_what_the_plant_does_not_have_is_refused(faults: list[str], states: list[str], words: str) -> None:
    with pytest.raises(PlaybookError, match=words):
        questions(reactor(), faults, 1, states)


@pytest.mark.slow
def test_an_answer_is_what_was_released_with_the_diagnosis_given() -> None:
    entry = answered(reactor(), Question(FAULT, 0.7, "normal", ONSET_S, 1))
    assert entry.occasion.hypotheses == (Hypothesis((FaultState(FAULT, 0.7, ONSET_S),), 1.0),)
    assert entry.answer is not None and entry.aftermath is None and entry.answer.path[0] == "normal"
    assert entry == answered(reactor(), Question(FAULT, 0.7, "normal", ONSET_S, 1)), "equal questions, equal answers"
    assert len(book(entry)) == 1


@pytest.mark.slow
def test_where_there_is_no_answer_it_is_said() -> None:
    entry = answered(reactor(), Question("leak", 0.0198, "normal", ONSET_S, 2))
    assert entry.answer is None or entry.answer.path
    left = answered(reactor(), Question("level_bias", 0.15, "normal", ONSET_S, 1))
    assert left.answer is None and not left.needed and left.reason.startswith("nothing need be done")
    assert not left.usable and len(book(left)) == 0


def test_building_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = questions(reactor(), [FAULT, "level_bias"], severities=1)
    calls: list[Question] = []

    def quick(plant: object, question: Question) -> Entry:
        calls.append(question)
        if len(calls) == 2:
            raise RuntimeError("a bug\nin one of them")
        return replace(entries_of(first())[0], source=question.source)

    monkeypatch.setattr("homeostat.evaluate.playbook.building.answered", quick)
    path, shown = tmp_path / "book", list[object]()
    done = build(reactor(), asked, path, Hands(), shown.append)
    assert [one.failure for one in done] == ["", "RuntimeError: a bug in one of them"] and len(shown) == 2
    left = left_of(reactor(), asked, path)
    assert left == asked[1:] and len(read_playbook(path).entries) == 1
    build(reactor(), left, path, Hands(), shown.append)
    assert left_of(reactor(), asked, path) == [] and calls == [*asked, asked[1]]


def test_entries_of_another_configuration_do_not_count_as_answers(tmp_path: Path) -> None:
    (question,) = questions(reactor(), [FAULT], severities=1)
    entry = replace(entries_of(first())[0], source=question.source, configuration="0" * 64)
    add_to_playbook(tmp_path / "book", [entry])
    assert left_of(reactor(), [question], tmp_path / "book") == [question]


def test_a_worker_that_is_not_alike_answers_nothing() -> None:
    (question,) = questions(reactor(), [FAULT], severities=1)
    place = Workplace.of(reactor())
    assert "another version" in elsewhere(replace(place, package="0"), question).failure
    assert "another cstr" in elsewhere(replace(place, configuration="0"), question).failure


def test_a_test_move_is_no_recovery() -> None:
    record = first().record
    assert len(recoveries(record.entries)) == len(record.of_kind(ReleasedActions))
    probes = type(record)()
    for each in record.entries:
        event = replace(each.event, cost=None) if isinstance(each.event, Attempted) else each.event
        probes(event, each.at_s)
    assert recoveries(probes.entries) == []


@pytest.mark.parametrize("what", [AlternativeKind.TEST, AlternativeKind.HOLD])
def test_what_a_model_holds_or_tests_for_a_while_is_no_recovery_that_lasted(what: AlternativeKind) -> None:
    """They have a cost like everything in the list, and the commands may be those of something that was to last."""
    short = type(first().record)()
    for each in first().record.entries:
        event = each.event
        if isinstance(event, Attempted):
            short(event, each.at_s)
            event = replace(event, what=what, seconds=60.0)
        elif isinstance(event, ReleasedActions) and what is AlternativeKind.HOLD:
            event = replace(event, for_s=60.0)
        elif isinstance(event, ReleasedActions):
            short(Probed(("a", "b"), event.state, event.commands, 60.0, 4.0, 0.1, 0.0, "language"), each.at_s)
        short(event, each.at_s)
    assert recoveries(first().record.entries) and recoveries(short.entries) == []
