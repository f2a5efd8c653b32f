"""Waits, holds and tests in a planning model's answer: one thing at a time, inside its bounds, told in the prompt."""

from __future__ import annotations

import asyncio
import json
from dataclasses import replace
from typing import Any

import pytest

from homeostat.agents.language.answers import ANSWER, LEAST_S, MOST_S, Unusable, planning_type, read
from homeostat.agents.language.feedback import feedback_text
from homeostat.agents.roles import Hold, NoAdmissiblePlan, Plan, Probe, Wait
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.domain.verdict import Finding, Revise
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from tests.agents.language.situations import Agents, situation
from tests.twin.followed import reactor

MACHINE = reactor().description.machine
REDUCE = RecoveryPath(MACHINE, tuple(t for t in MACHINE.transitions if t.name == "t_reduce"))
TEST = Probe(ActionSet((Command("F1.sp", 0.03, 0.001),), "reduced_load"), REDUCE, ("fouling", "inlet"), 3.0, 0.1, 0.02)
PATH = "normal > reduced_load"


def plan(tests: tuple[Probe, ...] = (), **answer: Any) -> tuple[Plan | Revise, Question]:
    """What a model's answer is taken for, and what it was asked."""
    model = ScriptedModel("m", lambda q: json.dumps({"reasoning": "so", "path": "none", **answer}))
    now = replace(situation("fouling"), tests=tests)
    return asyncio.run(Agents(model, "fouling").planning.plan(now, Advice())), model.asked[0]


def test_a_wait_a_hold_and_a_test_are_answers() -> None:
    assert plan(wait_s=180)[0] == Wait(180.0)
    held, _ = plan(path="normal > holding", hold_s=60.0)
    assert isinstance(held, Hold) and held.seconds == 60.0 and held.path.states == ("normal", "holding")
    found, asked = plan((TEST,), test="test 1")
    assert found is TEST
    assert "- test 1: normal > reduced_load: F1.sp=0.03: tells fouling from inlet, 3.0 nats" in asked.prompt


def test_that_nothing_helps_is_still_an_answer() -> None:
    with pytest.raises(NoAdmissiblePlan):
        plan()


@pytest.mark.parametrize(
    "answer",
    [
        {"wait_s": LEAST_S - 1.0},
        {"wait_s": MOST_S + 1.0},
        {"wait_s": "60"},
        {"path": "normal > holding", "wait_s": 60.0},
        {"hold_s": 60.0},
        {"path": "normal > holding", "hold_s": 60.0, "wait_s": 60.0},
        {"test": "test 1", "wait_s": 60.0},
        {"path": "normal > holding", "test": "test 1"},
        {"test": "test 2"},
    ],
)
def test_what_means_two_things_or_nothing_is_refused(answer: dict[str, Any]) -> None:
    found, _ = plan((TEST,), **answer)
    assert isinstance(found, Revise) and found.findings[0].criterion == ANSWER


def test_what_is_not_on_offer_is_not_in_the_schema() -> None:
    _, asked = plan(wait_s=60.0)
    assert "test" not in asked.schema["properties"] and "Tests on offer" not in asked.prompt  # type: ignore[operator]
    assert isinstance(
        read(planning_type((PATH,)), json.dumps({"reasoning": "", "path": PATH, "test": "test 1"})), Unusable
    )
    step = planning_type((PATH,), lasting=True)
    assert isinstance(read(step, json.dumps({"reasoning": "", "path": PATH, "hold_s": 60.0})), Unusable)


def test_a_refused_wait_is_told_and_closes_no_path() -> None:
    hot = Finding("LIM-T-HIGH", Owner.ACTION, -0.5, "K", 500.0, 0, "too hot")
    attempt = Attempt(1, None, ActionSet((), "normal"), Revise((hot,)), 12, kind=AlternativeKind.WAIT, seconds=300.0)
    agents = Agents(ScriptedModel("m", lambda q: "{}"), "fouling")
    before = Advice(refused_paths=(("holding",),))
    advice = asyncio.run(agents.reprompting.advise(situation("fouling"), attempt, before))
    assert advice.refused_paths == (("holding",),) and advice.keep_path is None and "shorter" in advice.hint
    assert agents.model.asked == [], "a rule fits, so nobody is asked"
    told = feedback_text(replace(advice, attempts=(attempt,)), reactor().description)
    assert "1. wait 300 s: nothing released: LIM-T-HIGH -0.5 K at 500 s" in told


def test_a_hold_that_is_refused_is_kept_with_its_length() -> None:
    agents = Agents(ScriptedModel("m", lambda q: "{}"), "fouling")
    findings = (Finding(ANSWER, Owner.ACTION, -float("inf"), "1", 0.0, 0, "not JSON"),)
    attempt = Attempt(1, REDUCE, None, Revise(findings), kind=AlternativeKind.HOLD, seconds=120.0)
    advice = asyncio.run(agents.reprompting.advise(situation("fouling"), attempt, Advice()))
    assert advice.keep_path == REDUCE and advice.keep_s == 120.0
