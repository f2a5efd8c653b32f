"""Language agents on batches: they name a whole route and give what it leaves open; two questions are enough."""

from __future__ import annotations

import functools
import json
from typing import Any

import pytest

from homeostat.agents.language.answers import Unusable, planning_type, read
from homeostat.agents.language.scripts import reasonable, stubborn
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.recovery import Attempted
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.tokens import exact
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import Language, model_alone

pytestmark = pytest.mark.filterwarnings("ignore:open_binary is deprecated:DeprecationWarning")  # on counting tokens

MOST_CALLS, MOST_TOKENS = 2, 6000
"""What a run may need where nothing is refused."""
SEVERITY = {"pump_degradation": 0.5}
BATCHES = (("pump_failure", 114.0), ("pump_degradation", 50.0), ("sensor_stuck_B202", 40.0))


@functools.cache
def plant() -> Plant:
    """The Mixing Module."""
    return load_plant("mixing_module")


@functools.cache
def batch(fault: str, onset_s: float, seed: int = 3) -> tuple[Run, tuple[Question, ...], MemoryTrace]:
    """One batch with a script that reads what a model reads: its result, what was asked, and its trace."""
    model, trace = ScriptedModel("reasonable", reasonable), MemoryTrace()
    chosen = scenario(plant(), fault, seed, onset_s, SEVERITY.get(fault), 400.0)
    return (
        run(plant(), chosen, trace, DeclaredClock(1.0), Proposing(Language(model), propose=model_alone)),
        tuple(model.asked),
        trace,
    )


def tokens(question: Question) -> int:
    """Tokens of a question as a provider counts them, its schema included."""
    counted = [exact(text) for text in (question.system, question.prompt, json.dumps(question.schema))]
    return sum(n for n in counted if n is not None)


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "onset_s"), [*BATCHES, pytest.param("pump_failure", 20.0, marks=pytest.mark.wide)])
def test_two_questions_and_a_few_thousand_tokens_are_enough(fault: str, onset_s: float) -> None:
    result, asked, _ = batch(fault, onset_s)
    assert (result.actor, result.state) == ("language", "complete")
    assert [q.agent for q in asked] == ["planning", "action"][: len(asked)] and 1 <= len(asked) <= MOST_CALLS
    assert 500 < sum(map(tokens, asked)) <= MOST_TOKENS


def test_the_route_that_is_named_is_the_one_that_is_carried_out() -> None:
    _, asked, trace = batch("pump_failure", 114.0)
    named = json.loads(reasonable(asked[0]))["path"].split(" > ")
    assert "bypass_emptying_B201" in named[1] and named[-1] == "complete"
    entered = [e.state for e in trace.of(StateEntered)]
    assert entered[-len(named) + 1 :] == named[1:]


def test_what_is_asked_is_what_the_route_leaves_open() -> None:
    _, (planning, action), trace = batch("pump_failure", 114.0)
    schema: Any = action.schema
    assert set(schema["properties"]["commands"]["properties"]) == {"P102.cmd"}
    told = json.loads(reasonable(action))["commands"]["P102.cmd"]
    (attempt,) = [a for a in trace.of(Attempted) if a.proposer == "language"]
    values = {c.tag: c.value for c in attempt.commands}
    assert values["P102.cmd"] == told and values["P101.cmd"] == 0.0 and values["VO204.cmd"] == 0.0
    assert " > ".join(attempt.path) in planning.prompt


def test_every_open_route_is_told_with_its_risk_and_the_present_one_is_marked() -> None:
    _, (asked, *_), _ = batch("pump_degradation", 50.0)
    schema: Any = asked.schema
    options = schema["properties"]["path"]["enum"]
    lines = [line for line in asked.prompt.splitlines() if " > " in line and line.startswith("- ")]
    assert len(lines) == len(options) - 1 and options[-1] == "none"
    same = [line for line in lines if line.endswith("this is what follows without action")]
    assert len(same) == 1 and "bypass" not in same[0] and "risk 1" in same[0]


def test_a_guard_that_reads_a_lying_instrument_is_not_on_offer() -> None:
    """The states are the same as without action; what is waited for is not."""
    _, (asked, *_), trace = batch("sensor_stuck_B202", 40.0)
    assert "this is what follows without action" not in asked.prompt
    (attempt, *_) = trace.of(Attempted)
    assert attempt.path[-1] == "complete"


@pytest.mark.slow
def test_a_route_with_nothing_open_asks_the_action_agent_nothing() -> None:
    """A held batch, or one that only drains: commands and guards are the machine's."""
    _, asked, _ = batch("sensor_drift_B204", 150.0, seed=4)
    assert {q.agent for q in asked} == {"planning"}


def test_a_route_that_is_not_on_offer_is_a_finding() -> None:
    _, (asked, *_), _ = batch("pump_failure", 114.0)
    schema: Any = asked.schema
    kind = planning_type(tuple(schema["properties"]["path"]["enum"][:-1]))
    main = "emptying_B201 > emptying_B202 > emptying_B203 > emptying_B204 > complete"
    assert isinstance(read(kind, json.dumps({"reasoning": "", "path": main})), Unusable), "its pump has failed"


@pytest.mark.slow
def test_search_takes_over_from_a_model_that_always_says_the_same() -> None:
    """Full clogging of the common line: there is no way through, and holding is found by whoever looks for it."""
    model, trace = ScriptedModel("stubborn", stubborn), MemoryTrace()
    chosen = scenario(plant(), "clogging_common", 3, 120.0, 1.0, 400.0)
    result = run(plant(), chosen, trace, DeclaredClock(1.0), Proposing(Language(model)))
    assert result.actor == "search" and result.state in ("held", "complete")
    assert max(result.totals[n] for n in ("overflowed_L", "dry_run_s", "dead_head_s")) == 0.0
