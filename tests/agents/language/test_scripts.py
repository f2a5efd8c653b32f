"""The scripts: models that read what a language model reads, and nothing else."""

from __future__ import annotations

import asyncio
import json
from dataclasses import replace
from typing import Any

import pytest

from homeostat.agents.language.answers import Unusable, action_type, planning_type, read, reprompting_type
from homeostat.agents.language.scripts import SCRIPTS, reasonable, stubborn
from homeostat.domain.advice import Advice
from homeostat.domain.verdict import Approve, Revise
from homeostat.llm.scripted import ScriptedModel
from tests.agents.language.answering import STATES, TAGS, text
from tests.agents.language.situations import FAULTS, Agents, questions
from tests.llm.asking import question
from tests.twin.followed import reactor

RULES = "ACC-T-HIGH {margin:+g} K at 600 s: T1 <= 312.7; margin per step: F1.sp +0.0005 -> -0.2 K, T1.sp +0.1 -> +0 K"
PRESENT = """- F1.sp «Feed»: 0.002 to 0.033 L/s in steps of 0.0005; now 0.0333333 L/s, design 0.0333333 L/s
- L1.sp «Setpoint of the level»: 6 to 10.4 L in steps of 0.1; now 10 L, design 10 L
- T1.sp «Setpoint of the temperature»: 298 to 312.6 K in steps of 0.1; now 310 K, design 310 K
- V2.man «Manual output of V2»: 0 to 1 in steps of 0.01; now automatic, design automatic (null)"""
REDUCED = next(s for s in STATES if s.name == "reduced_load")


def asked(prompt: str) -> Any:
    """A question about the commands of reduced load."""
    from homeostat.agents.language.answers import schema

    return question(agent="action", prompt=prompt, schema=schema(action_type(REDUCED.open_setpoints, TAGS)))


def commands(answer: str) -> dict[str, float | None]:
    found: dict[str, float | None] = json.loads(answer)["commands"]
    return found


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("script", SCRIPTS)
def test_every_answer_satisfies_the_schema(script: str, fault: str) -> None:
    machine = reactor().description.machine
    for q in questions(fault):
        answer = SCRIPTS[script](q)
        if q.agent == "planning":
            options: Any = q.schema["properties"]["path"]["enum"]  # type: ignore[index]
            if script == "stubborn" and "\n1. " in q.prompt:
                continue  # it says what it said at first, whether it is on offer or not
            assert not isinstance(read(planning_type(options[:-1]), answer), Unusable)
        else:
            targets = [s for s in machine.states if s.recovery_target]
            asked_for = set(q.schema["properties"]["commands"]["properties"])  # type: ignore[index]
            assert any(
                {r.tag for r in s.open_setpoints} == asked_for
                and not isinstance(read(action_type(s.open_setpoints, TAGS), answer), Unusable)
                for s in targets
            )
    advice = SCRIPTS[script](question(agent="reprompting"))
    assert not isinstance(read(reprompting_type(), advice), Unusable)


def test_a_stubborn_model_names_its_first_path_ever_after() -> None:
    schema = {"properties": {"path": {"enum": ["normal > holding", "none"]}}}
    first = question(agent="planning", prompt="nothing was tried", schema=schema)
    later = question(agent="planning", prompt="# Tried\n1. normal > reduced_load: F1.sp=0.03: ACC -1 K", schema=schema)
    assert json.loads(stubborn(first))["path"] == "normal > holding"
    assert json.loads(stubborn(later))["path"] == "normal > reduced_load"


def test_at_first_the_present_commands_are_kept() -> None:
    for script in (reasonable, stubborn):
        assert commands(script(asked(PRESENT))) == {"F1.sp": 0.033, "L1.sp": 10.0, "T1.sp": 310.0, "V2.man": None}


def test_one_command_is_moved_against_what_was_violated() -> None:
    """0.75 K are missing, every half gram per second is worth 0.2 K: four steps down, with a little reserve."""
    moved = commands(reasonable(asked(f"{PRESENT}\n{RULES.format(margin=-0.75)}")))
    assert moved == {"F1.sp": 0.031, "L1.sp": 10.0, "T1.sp": 310.0, "V2.man": None}


def test_the_attempt_that_was_judged_is_where_it_goes_on() -> None:
    attempts = "1. normal > reduced_load: F1.sp=0.03 L1.sp=9 T1.sp=308 V2.man=0.5: ACC-T-HIGH -1 K at 600 s\n"
    attempts += "2. normal > reduced_load: F1.sp=0.02 L1.sp=9 T1.sp=308 V2.man=auto: ACC-T-HIGH -0.2 K at 600 s"
    told = RULES.format(margin=-0.2)
    moved = commands(reasonable(asked(f"{PRESENT}\n{attempts}\n# What attempt 2 violated\n{told}")))
    assert moved == {"F1.sp": 0.019, "L1.sp": 9.0, "T1.sp": 308.0, "V2.man": None}
    first = commands(reasonable(asked(f"{PRESENT}\n{attempts}\n# What attempt 1 violated\n{told}")))
    assert first == moved | {"F1.sp": 0.029, "V2.man": 0.5}, "the feedback says which attempt it is about"
    assert commands(stubborn(asked(f"{PRESENT}\n{attempts}"))) == commands(stubborn(asked(PRESENT)))


def test_curing_one_does_not_break_another_where_it_is_told() -> None:
    near = "holds only just: LIM-L-LOW +0.1 L at 900 s: L1 >= 2; margin per step: F1.sp +0.0005 -> +0.1 L"
    careless = commands(reasonable(asked(f"{PRESENT}\n{RULES.format(margin=-2.0)}")))
    careful = commands(reasonable(asked(f"{PRESENT}\n{RULES.format(margin=-2.0)}\n{near}")))
    assert careless["F1.sp"] is not None and careful["F1.sp"] is not None
    assert careless["F1.sp"] <= careful["F1.sp"]


def test_a_question_without_anything_to_read_gets_admissible_commands() -> None:
    for script in (reasonable, stubborn):
        answer = script(asked("nothing that can be read"))
        assert not isinstance(read(action_type(REDUCED.open_setpoints, TAGS), answer), Unusable)


def test_the_answers_of_other_tests_are_read() -> None:
    assert not isinstance(read(action_type(REDUCED.open_setpoints, TAGS), text(REDUCED)), Unusable)


@pytest.mark.parametrize("fault", ["cool_stuck_closed", "pump_degrade", "fouling"])
def test_what_the_feedback_says_is_enough_to_be_approved(fault: str) -> None:
    """The teaching works: a script that knows nothing but its prompts finds commands that validation approves."""
    agents = Agents(ScriptedModel("reasonable", reasonable), fault)

    async def learn() -> list[bool]:
        advice = Advice()
        for _ in range(6):
            advice = await agents.attempt(advice)
            if isinstance(agents.attempts[-1].verdict, Approve):
                break
        return [isinstance(a.verdict, Approve) for a in agents.attempts]

    approved = asyncio.run(learn())
    assert approved[-1] and not any(approved[:-1])


def test_a_stubborn_model_learns_nothing() -> None:
    agents = Agents(ScriptedModel("stubborn", stubborn))

    async def learn() -> None:
        advice = await agents.attempt(Advice())
        await agents.attempt(replace(advice, tries=0))

    asyncio.run(learn())
    first, second = agents.attempts
    assert first.actions is not None and second.actions is not None and first.actions.digest == second.actions.digest
    assert isinstance(second.verdict, Revise)
