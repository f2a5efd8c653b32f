"""Scores of single steps, computed by hand."""

from __future__ import annotations

import asyncio
import functools
import json

import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import FallbackNeeded, NoActionNeeded
from homeostat.evaluate.conditions import LabelGiven
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.evaluate.score.step_scores import score_steps
from homeostat.evaluate.transcript import TranscribedModel, TranscriptEntry
from homeostat.llm.model import Failure, ModelError, Question
from homeostat.llm.replay import SUPPLIED
from homeostat.llm.scripted import ScriptedModel
from homeostat.plants.plant import Plant, load_plant
from homeostat.record.result import StepScores
from tests.agents.scripted import ScriptedMonitoring


@functools.cache
def plant() -> Plant:
    return load_plant("mixing_module")


def plan(state: str, named: str) -> TranscriptEntry:
    return TranscriptEntry("planning", state, json.dumps({"path": named}))


def act(state: str, *on: str) -> TranscriptEntry:
    tags = ("VI201", "VI202", "VO201", "VI204", "VO204", "P101", "P102")
    return TranscriptEntry("action", state, json.dumps({"commands": {f"{tag}.cmd": float(tag in on) for tag in tags}}))


def failed(severity: float = 1.0) -> Scenario:
    return scenario(plant(), "pump_failure", 3, 0.0, severity, 400.0)


def test_answers_are_counted_against_the_route_that_works() -> None:
    """The main pump has failed, so that the bypass is right; one plan is wrong, two actuators too many, one missing."""
    said = [
        plan("idle", "filling_B201"), act("idle", "VI201"),
        plan("filling_B203", "emptying_B201"),
        TranscriptEntry("reprompting", "filling_B203", "{}"),
        plan("filling_B203", "bypass_emptying_B201"), act("filling_B203", "VO201", "P102", "P101", "VO204"),
    ]  # fmt: skip
    scores = score_steps(plant(), failed(), said)
    assert scores == StepScores(3, 2, 2, 1, on_right=3, on_wrong=2, on_missed=1)
    assert scores.precision == pytest.approx(3 / 5) and scores.recall == pytest.approx(3 / 4)


def test_without_the_fault_the_main_line_is_right() -> None:
    healthy = scenario(plant(), "none", 3, end_s=400.0)
    scores = score_steps(plant(), healthy, [plan("filling_B203", "emptying_B201"), plan("filling_B203", "holding")])
    assert scores is not None and (scores.plans, scores.plans_right) == (2, 1)
    assert scores.precision is None and scores.recall is None and scores.actions == 0


@pytest.mark.parametrize("answer", ["", "no JSON", "[]", "3", '{"path": 3}', '{"commands": null}', "[" * 9_000])
def test_an_answer_that_is_none_is_a_wrong_one(answer: str) -> None:
    scores = score_steps(plant(), failed(), [TranscriptEntry("planning", "idle", answer), plan("idle", "filling_B201"),
                                            TranscriptEntry("action", "idle", answer)])  # fmt: skip
    assert scores == StepScores(2, 1, 1, 0, on_right=0, on_wrong=0, on_missed=1)


def test_an_answer_in_a_code_fence_is_read_as_the_agents_read_it() -> None:
    said = plan("idle", "filling_B201")
    fenced = TranscriptEntry(said.agent, said.state, f"```json\n{said.answer}\n```")
    assert score_steps(plant(), failed(), [fenced]) == score_steps(plant(), failed(), [said])


def test_where_nothing_completes_there_is_no_key() -> None:
    plugged = scenario(plant(), "clogging_common", 3, 0.0, 1.0, 400.0)
    assert score_steps(plant(), plugged, [plan("idle", "filling_B201")]) is None


def test_what_is_said_is_kept_with_the_state_also_where_nothing_was() -> None:
    def answer(question: Question) -> str:
        if question.prompt:
            raise ModelError(Failure.TIMEOUT, "late")
        return "yes"

    transcribed = TranscribedModel(ScriptedModel("m", answer), lambda: "idle")
    assert transcribed.name == "m" and transcribed.settings == {}
    question = Question("planning", 1.0, "", "", {}, "")
    assert asyncio.run(transcribed.ask(question, 1.0)).answer == "yes"
    with pytest.raises(ModelError):
        asyncio.run(transcribed.ask(Question("action", 1.0, "", "x", {}, ""), 1.0))
    told = [(s.agent, s.state, s.answer, s.served) for s in transcribed.transcript]
    assert told == [("planning", "idle", "yes", "m"), ("action", "idle", "", "")]
    assert transcribed.transcript[0].asked_tokens > 0 and transcribed.transcript[0].answered_tokens == 1


def test_the_label_is_told_once_at_each_onset_and_is_the_truth() -> None:
    faults = (FaultState("pump_failure", 1.0, 10.0), FaultState("leakage_main", 0.3, 20.0))
    behind = ScriptedMonitoring()
    given = LabelGiven(behind, faults, 100.0)
    told = []
    for at_s in range(5, 30):
        if given.notices(Snapshot(float(at_s), {})):
            told.append((at_s, given.diagnose().hypotheses))
            given.follow(NoActionNeeded(float(at_s), 0.0))
    assert told == [(10, (Hypothesis(faults[:1], 1.0),)), (20, (Hypothesis(faults, 1.0),))]
    assert given.diagnose().faulty and given.symptoms == behind.symptoms


def test_no_label_is_told_where_nothing_is_wrong() -> None:
    given = LabelGiven(ScriptedMonitoring(), (), 100.0)
    assert not given.notices(Snapshot(1.0, {})) and not given.diagnose().faulty


def test_what_is_told_is_looked_at_again_until_the_fallback_has_acted() -> None:
    given = LabelGiven(ScriptedMonitoring(), (FaultState("fouling", 0.5, 10.0),), 30.0)
    looked = []
    for at_s in range(5, 120):
        if given.notices(Snapshot(float(at_s), {})):
            looked.append(at_s)
            assert given.diagnose().hypotheses[0].probability == 1.0
            given.follow(FallbackNeeded("late", float(at_s)) if at_s >= 70 else NoActionNeeded(float(at_s), 0.0))
    assert looked == [10, 40, 70]


def test_answers_that_a_loop_supplied_are_nobodys() -> None:
    said = [
        TranscriptEntry("planning", "idle", '{"path": "filling_B201"}'),
        TranscriptEntry("planning", "idle", "{}", served=SUPPLIED),
    ]
    scores = score_steps(plant(), scenario(plant(), "none", 3, end_s=400.0), said)
    assert scores is not None and (scores.plans, scores.plans_right) == (1, 1)
