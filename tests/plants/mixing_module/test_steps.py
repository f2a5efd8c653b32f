"""The published protocol: agents are asked in every state for the next step, judged as the begin of a whole route."""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from homeostat.agents.language.scripts import reasonable
from homeostat.agents.roles import AskingProtocol, NoAdmissiblePlan, Proposer
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.recovery import Attempted, GaveUp, NoActionTaken, ReleasedActions
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.evaluate.score.step_scores import score_steps
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.llm.model import Failure, ModelError, Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.plants.error import PlantError
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import Language, Workbench, in_operation
from homeostat.record.result import StepScores

pytestmark = pytest.mark.slow

PER_STEP = AskingProtocol.PER_STEP
MAIN = (
    "filling_B201", "filling_B202", "filling_B203", "emptying_B201", "emptying_B202", "emptying_B203", "emptying_B204",
    "complete",
)  # fmt: skip
BYPASS = tuple(s.replace("emptying", "bypass_emptying") if "B204" not in s else s for s in MAIN)
STATE = re.compile(r"^State (\S+) \(", re.MULTILINE)


@functools.cache
def plant() -> Plant:
    return load_plant("mixing_module")


def stepwise(
    fault: str, severity: float | None, answer: Callable[[Question], str], label_given: bool = True
) -> tuple[Run, list[Question], MemoryTrace]:
    """A batch in which every step is asked for; the fault is there from the start."""
    model, trace = ScriptedModel("scripted", answer), MemoryTrace()
    chosen = scenario(plant(), fault, 3, None if fault == "none" else 0.0, severity, 400.0)
    conditions = Conditions(PER_STEP, label_given)
    result = run(plant(), chosen, trace, DeclaredClock(1.0), Proposing(Language(model), conditions))
    assert max(result.totals[n] for n in ("overflowed_L", "dry_run_s", "dead_head_s")) == 0.0
    return result, model.asked, trace


@functools.cache
def by_reason(fault: str, severity: float | None, label_given: bool = True) -> tuple[Run, list[Question], MemoryTrace]:
    """The batch in which every answer is reasonable; each is run once for all tests that read it."""
    return stepwise(fault, severity, reasonable, label_given)


def entered(trace: MemoryTrace) -> tuple[str, ...]:
    return tuple(e.state for e in trace.of(StateEntered))


def actors(trace: MemoryTrace) -> set[str]:
    """Who proposed what was released."""
    return {e.proposer for e in trace.of(ReleasedActions)}


def state(question: Question) -> str:
    found = STATE.search(question.prompt)
    assert found is not None
    return found[1]


@pytest.mark.parametrize(
    ("fault", "severity", "states"),
    [
        ("none", None, MAIN),
        pytest.param("pump_failure", 1.0, BYPASS, marks=pytest.mark.wide),
        pytest.param("sensor_bias_flow", -0.15, MAIN, marks=pytest.mark.wide),
    ],
)
def test_both_agents_are_asked_once_in_every_state(fault: str, severity: float | None, states: tuple[str, ...]) -> None:
    result, asked, trace = by_reason(fault, severity)
    assert entered(trace) == states and actors(trace) == {"language"} and result.complete_s is not None
    assert result.actor == ("none" if fault == "none" else "language"), "the batch as usual is nobody's action"
    assert [(q.agent, state(q)) for q in asked] == [
        (agent, name) for name in ("idle", *states[:-1]) for agent in ("planning", "action")
    ]
    scores = score_steps(plant(), result.scenario, result.transcript)
    assert scores == StepScores(8, 8, 8, 8, scores.on_right if scores else 0, 0, 0)


def test_every_actuator_is_asked_for_and_none_is_told() -> None:
    _, asked, _ = by_reason("none", None)
    schema: Any = asked[1].schema
    commands = schema["properties"]["commands"]["properties"]
    assert len(commands) == 10 and all((c["minimum"], c["maximum"]) == (0.0, 1.0) for c in commands.values())
    assert "design" not in asked[1].prompt
    assert ":range_filling_B201_VI201.cmd hs:high 1; hs:low 1; hs:ofTag :tag_VI201.cmd." in asked[1].prompt


def test_a_wrong_line_is_refused_by_the_rollout_and_the_other_one_asked_for() -> None:
    """The main line is clogged: nobody tells the model, who names the main line, that the bypass is right."""

    def main_first(question: Question) -> str:
        schema: Any = question.schema
        if question.agent == "planning" and "emptying_B201" in schema["properties"]["path"]["enum"]:
            return json.dumps({"reasoning": "", "path": "emptying_B201"})
        return reasonable(question)

    result, asked, trace = stepwise("clogging_main", 1.0, main_first)
    assert entered(trace) == BYPASS and result.actor == "language"
    refused = [a for a in trace.of(Attempted) if not a.approved and a.path[:2] == ("filling_B203", "emptying_B201")]
    assert len(refused) == 1
    assert {"LIM-P101-IDLE"} <= {f.criterion for f in refused[0].findings if f.margin < 0}
    again = [q for q in asked if q.agent == "planning" and state(q) == "filling_B203"]
    options: Any = again[-1].schema
    assert len(again) == 2 and "emptying_B201" not in options["properties"]["path"]["enum"]
    scores = score_steps(plant(), result.scenario, result.transcript)
    assert scores is not None and scores.plans_right < scores.plans and scores.actions_right == scores.actions


EXTRA = {"filling_B201": {"VO201.cmd": 1.0, "VI204.cmd": 1.0}, "emptying_B204": {"P101.cmd": 1.0, "VI204.cmd": 1.0}}


@pytest.mark.wide
@pytest.mark.parametrize("target", ["emptying_B204", pytest.param("filling_B201", marks=pytest.mark.wide)])
def test_an_actuator_too_many_is_refused_and_asked_for_again(target: str) -> None:
    wrong: list[str] = []

    def once_wrong(question: Question) -> str:
        answer = json.loads(reasonable(question))
        if question.agent == "action" and f"state {target} (" in question.prompt and not wrong:
            wrong.append(question.prompt)
            answer["commands"] |= EXTRA[target]
        return json.dumps(answer)

    result, asked, trace = stepwise("none", None, once_wrong)
    assert entered(trace) == MAIN and actors(trace) == {"language"} and len(wrong) == 1
    assert result.complete_s is not None
    (refused,) = [a for a in trace.of(Attempted) if not a.approved]
    violated = {f.criterion for f in refused.findings if f.margin < 0}
    assert "CHK-RANGE" in violated
    assert ("PRM-DRAIN" in violated) == (target == "emptying_B204"), "the drain is closed during a transfer"
    following = asked[[q.prompt for q in asked].index(wrong[0]) + 1]
    assert following.agent == "action" and "CHK-RANGE" in following.prompt, "the path was not at fault"


@pytest.mark.wide
def test_a_model_that_never_says_anything_usable_costs_nothing_but_time() -> None:
    """What was approved for a step is approved as the begin of a whole route; the search takes every step instead."""
    result, asked, trace = stepwise("none", None, lambda question: "no")
    assert entered(trace) == MAIN and actors(trace) == {"search"} and result.complete_s is not None
    assert len(asked) >= 8 and not [a for a in trace.of(Attempted) if a.approved and a.proposer == "language"]


def test_without_a_label_the_line_is_changed_when_the_fault_is_found() -> None:
    """A failed pump that nobody can know of before it is started."""
    result, _, trace = by_reason("pump_failure", 1.0, label_given=False)
    assert "emptying_B201" in entered(trace) and "bypass_emptying_B201" in entered(trace)
    assert result.complete_s is not None and result.detected_s is not None and result.hypotheses


def test_a_step_that_was_asked_for_in_vain_is_asked_for_again() -> None:
    """A plant that stands because nobody had an answer would stand for ever."""
    refused: list[str] = []

    def at_second(question: Question) -> str:
        if not refused:
            refused.append(question.prompt)
            raise ModelError(Failure.TIMEOUT, "late")
        return reasonable(question)

    class Silent:
        """Implements planning: the search has nothing to say the first time either."""

        def __init__(self, planning: Any) -> None:
            self._planning, self._asked = planning, 0

        async def plan(self, situation: Any, advice: Any) -> Any:
            self._asked += 1
            if self._asked == 1:
                raise NoAdmissiblePlan("nothing comes to mind")
            return await self._planning.plan(situation, advice)

    def propose(bench: Workbench) -> tuple[Proposer, ...]:
        speaking, searching = in_operation(bench)
        return speaking, replace(searching, planning=Silent(searching.planning))

    model, trace = ScriptedModel("scripted", at_second), MemoryTrace()
    chosen, clock = scenario(plant(), "none", 3, end_s=300.0), DeclaredClock(1.0)
    conditions = Conditions(PER_STEP)
    run(plant(), chosen, trace, clock, Proposing(Language(model), conditions, propose))
    assert len(trace.of(GaveUp)) == 2 and entered(trace) == MAIN


def test_steps_are_refused_where_there_is_no_batch() -> None:
    cstr = load_plant("cstr")
    with pytest.raises(PlantError, match="from 'starting' no path leads"):
        run(cstr, scenario(cstr, "none", 3, end_s=10.0), proposing=Proposing(conditions=Conditions(PER_STEP)))


def test_steps_as_usual_are_no_recovery() -> None:
    """Monitoring gathers its evidence as if nothing had been released."""
    result, _, trace = by_reason("pump_failure", 1.0, label_given=False)
    assert result.detected_s is not None and result.detected_s > 100.0
    usual = [e for e in trace.entries if isinstance(e.event, NoActionTaken)]
    assert not usual or usual[0].at_s > result.detected_s
