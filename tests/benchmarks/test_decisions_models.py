"""The study of models beside the search: scripts, what counts as the model's own, and what the page says of it."""

from __future__ import annotations

import json
from typing import Any

import pytest

from benchmarks.decisions.better import CASES, Better, causes
from benchmarks.decisions.loop import FromThenOn
from benchmarks.decisions.measure import Decision
from benchmarks.decisions.models import ALONE, SEATS, Seat, Seated, compared, contributed
from benchmarks.decisions.page_models import beside, better_answers
from benchmarks.decisions.seats import OneAnswer, careless
from benchmarks.unknown.causes import KNOWN, Cause
from homeostat.agents.language.answers import Unusable, action_type, planning_type, read, schema
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.recovery import Compared, Probed, ReleasedActions, Waited
from homeostat.plants.plant import load_plant
from homeostat.record.run_record import RunRecord
from tests.agents.language.answering import STATES, TAGS
from tests.llm.asking import question
from tests.recovery.desk import Watching
from tests.twin.followed import readings

PATHS = ("normal > compensated", "normal > reduced_load")
REDUCED = next(s for s in STATES if s.name == "reduced_load")
PLANNING = planning_type(PATHS, tests=("test 1",))
COST = Cost((), 30.0)


def planning(prompt: str = "", at_s: float = 0.0, tests: bool = True) -> Any:
    kind = PLANNING if tests else planning_type(PATHS)
    return question(agent="planning", prompt=prompt, schema=schema(kind), at_s=at_s)


def action(prompt: str = "") -> Any:
    return question(agent="action", prompt=prompt, schema=schema(action_type(REDUCED.open_setpoints, TAGS)))


@pytest.mark.parametrize("at_s", [0.0, 1.0, 2.0])
def test_every_careless_answer_can_be_read(at_s: float) -> None:
    assert not isinstance(read(PLANNING, careless(planning(at_s=at_s))), Unusable)
    for prompt in ("", "1. normal > reduced_load: F1.sp=0.033: refused"):
        assert not isinstance(read(action_type(REDUCED.open_setpoints, TAGS), careless(action(prompt))), Unusable)


def test_a_careless_model_gives_every_kind_of_answer() -> None:
    said = [json.loads(careless(planning(at_s=float(second)))) for second in range(3)]
    assert [("wait_s" in one, "hold_s" in one) for one in said] == [(True, False), (False, True), (False, False)]


def test_a_stated_answer_is_given_once_and_only_where_it_is_on_offer() -> None:
    test = OneAnswer({"test": "test 1"})
    assert json.loads(test(planning(tests=False)))["path"] == "none" and not test.given
    assert json.loads(test(planning()))["test"] == "test 1"
    assert "test" not in json.loads(test(planning()))
    held = json.loads(OneAnswer({"path": "reduced_load", "hold_s": 60.0})(planning()))
    assert (held["path"], held["hold_s"]) == (PATHS[1], 60.0)


def test_stated_commands_leave_manual_outputs_on_automatic() -> None:
    said = OneAnswer({"wait_s": 20.0}, {"F1.sp": 0.02})(action())
    commands = json.loads(said)["commands"]
    assert commands["F1.sp"] == 0.02 and commands["V2.man"] is None
    assert not isinstance(read(action_type(REDUCED.open_setpoints, TAGS), said), Unusable)


def released(proposer: str, digest: str, for_s: float = 0.0) -> ReleasedActions:
    return ReleasedActions(proposer, (), digest, "reduced_load", 0.1, for_s=for_s)


def listed(kind: AlternativeKind, digest: str, polished: bool = False) -> Compared:
    return Compared("EUR", (Alternative(kind, "x", COST, "", "language", digest, polished),), digest)


def test_only_what_the_model_proposed_counts_as_its_own_and_a_test_once() -> None:
    record = RunRecord()
    for event in (
        Waited("language", 20.0, "x"), Waited("search", 20.0, "x"), released("search", "a"),
        listed(AlternativeKind.TEST, "t"), Probed(("a", "b"), "x", (), 20.0, 1.0, 0.1, 0.0, "language"),
        released("language", "t"), listed(AlternativeKind.HOLD, "h"), released("language", "h", 60.0),
        listed(AlternativeKind.RELEASE, "r", polished=True), released("language", "r"),
    ):  # fmt: skip
        record(event, 10.0)
    assert contributed(record) == ({"wait": 1, "test": 1, "hold": 1, "release": 1}, 1)


def run(seed: int, cost: float | None, **done: int) -> Seated:
    return Seated("leak", 0.01, 100.0, seed, "recovered", cost, 0.0, 2 if done else 0, done, 0)


def test_a_run_is_held_against_the_same_run_of_the_search() -> None:
    alone = [run(1, 3.0), run(2, 4.0), run(3, None)]
    arm = [run(1, 2.5, wait=1), run(2, 4.7, release=1), run(3, None), run(4, 9.0)]
    assert [round(by, 3) for _, by in compared(alone, arm)] == [-0.5, 0.7]
    text = beside({"Reactor": {ALONE: alone, "careful": arm}}, {"Reactor": 4})
    assert "| Reactor | careful | 4 of 4 | 2 | 2 | 1 | 0 | 0 | 1 | 0 | 3.60 | 0.10 | +0.70 | 1 | 0 |" in text
    assert "- Reactor, careful: `leak` 0.01, seed 2, 1 release, recovered: +0.7 points" in text


def test_a_run_of_the_search_that_another_part_has_carried_out_is_not_carried_out_again() -> None:
    known = Decision("leak", 0.01, 2000.0, 7, "recovered", 2010.0, 1, 3.5, 3.0, None, 0.0, {})
    cause = Cause("leak", KNOWN, fault="leak", severity=0.01, onset_s=2000.0)
    found = Seat(ALONE, lambda: [known]).measure(load_plant("cstr"), cause, 7, "plant")
    assert (found.cost, found.asked, found.done) == (3.5, 0, {})
    assert set(SEATS) == {ALONE, "careful", "careless"}


def test_situations_are_told_apart_by_a_ledger_and_each_answer_is_another_kind() -> None:
    kept = [(cause.fault, seed) for cause, seed in causes()]
    assert len(set(kept)) == len(kept) == len(CASES) == len({case.kind for case in CASES}) == 3
    found = [Better("cool_stuck_closed", 401, "wait", 25.7, 24.6, {"wait": 1}, 0.0),
             Better("pump_degrade", 401, "hold", 3.0, None, {}, 0.0)]  # fmt: skip
    text = better_answers(found)
    assert "2 of 3 are in; 1 done as the model's own" in text
    assert "| 24.60 | 25.70 | 1.10 | yes | 0 s |" in text and "| none | 3.00 | none | **no** |" in text


def test_a_stated_diagnosis_is_given_at_its_moment_and_once() -> None:
    stated = (Hypothesis((FaultState("leak", 0.01, 0.0),), 1.0),)
    behind = Watching(2.0)
    monitoring = FromThenOn(behind, stated, 3.0)
    noticed = [monitoring.notices(snapshot) for snapshot in readings(3, 4)]
    assert noticed.index(True) >= 2
    assert monitoring.diagnose().hypotheses == stated
    assert monitoring.diagnose().hypotheses != stated
