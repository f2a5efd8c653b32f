"""A prompt by how it is grounded: the same situation and the same question, another account of the plant."""

from __future__ import annotations

import asyncio
import functools
import re

import pytest

from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.grounding.documents import context_finder
from homeostat.agents.language.action import LanguageAction
from homeostat.agents.language.planning import LanguagePlanning
from homeostat.agents.language.prompt_files import prompt_file, template_sha256
from homeostat.agents.language.reprompting import TeachingReprompting
from homeostat.agents.language.scripts import reasonable
from homeostat.agents.language.speaker import BUDGET
from homeostat.agents.language.stepwise import StepAction
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.events.recovery import Retrieved
from homeostat.domain.verdict import Revise
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.llm.model import Question
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.tokens import exact
from homeostat.plants.wired.assembly import Language, model_alone
from tests.agents.briefings import briefing
from tests.agents.language.situations import FAULTS, questions, simulation, situation
from tests.agents.stuck_valve import grounding
from tests.knowledge.test_documents import TURTLE
from tests.twin.followed import reactor

pytestmark = pytest.mark.filterwarnings("ignore:open_binary is deprecated:DeprecationWarning")
GRAPH, DOCUMENTS, NONE = GroundingKind
FAULT = "cool_stuck_closed"


@functools.cache
def asked(kind: GroundingKind, fault: str) -> dict[str, Question]:
    """What planning, action and action in one step are asked."""
    plant, now, model = reactor(), situation(fault), ScriptedModel("m", reasonable)
    shown = context_finder(kind, grounding(), plant.graph, plant.namespace)
    told = briefing(model, plant, simulation(fault), shown=shown)
    choice = LanguagePlanning(told).choice(now, Advice())
    path = next(iter(choice.paths.values()))
    action = LanguageAction(told)
    state = path.machine.state(path.target)
    step, _ = StepAction(told).order(now, state, Advice())
    return {"planning": choice.question, "action": action.order(now, path, Advice()).question, "step": step}


def plant_part(question: Question) -> str:
    """What stands under the heading of the plant."""
    return question.prompt.partition("# Plant\n")[2].partition("\n# ")[0]


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_not_said_otherwise_is_shown_from_the_graph(fault: str) -> None:
    """The agents without a context of their own ask what they always asked."""
    first = {q.agent: q for q in reversed(questions(fault)) if "# Refused so far" not in q.prompt}
    assert asked(GRAPH, fault)["planning"] == first["planning"]


@pytest.mark.parametrize("fault", FAULTS)
def test_only_the_account_of_the_plant_differs(fault: str) -> None:
    """Situation, paths, commands, schema are the same to the letter."""
    for name in ("planning", "action", "step"):
        graph, *others = (asked(kind, fault)[name] for kind in GroundingKind)
        told = graph.prompt.replace(f"# Plant\n{plant_part(graph)}", "").rstrip()
        for other in others:
            rest = (
                other.prompt.replace(f"# Plant\n{plant_part(other)}", "") if "# Plant" in other.prompt else other.prompt
            )
            assert rest.rstrip() == told and other.schema == graph.schema and other.at_s == graph.at_s


@pytest.mark.parametrize("fault", FAULTS)
def test_documents_are_shown_without_turtle(fault: str) -> None:
    for question in asked(DOCUMENTS, fault).values():
        assert not TURTLE.search(plant_part(question)) and "Turtle" not in question.system
        assert prompt_file("guide.documents").strip() in question.system and "hs:" not in question.system
        assert len(plant_part(question).splitlines()) > 3
        count = exact(question.system + question.prompt)
        assert count is not None and count <= BUDGET


@pytest.mark.parametrize("fault", FAULTS)
def test_none_has_no_heading_and_no_guide(fault: str) -> None:
    for question in asked(NONE, fault).values():
        assert "# Plant" not in question.prompt and "How to read" not in question.system
        assert not re.search(r"Turtle|graph|document|hs:", question.system)
        assert "\n\n" not in question.prompt + question.system
        headings = [k for k, line in enumerate(question.prompt.splitlines()) if line.startswith("# ")]
        assert all(b - a > 1 for a, b in zip(headings, [*headings[1:], len(question.prompt.splitlines())], strict=True))


@pytest.mark.parametrize("kind", GroundingKind)
def test_the_hash_says_how_a_prompt_is_grounded(kind: GroundingKind) -> None:
    for name, question in asked(kind, FAULT).items():
        agent = "action" if name == "step" else name
        assert question.template_sha256 == template_sha256(agent, kind)
    for agent in ("planning", "action"):
        assert len({template_sha256(agent, each) for each in GroundingKind}) == len(GroundingKind)


@pytest.mark.parametrize("kind", GroundingKind)
def test_the_rules_say_the_same_but_for_turtle(kind: GroundingKind) -> None:
    clause = ", and every quoted text in Turtle,"
    assert prompt_file("rules", kind) == prompt_file("rules").replace(clause, "" if kind is not GRAPH else clause)


@pytest.mark.parametrize("kind", GroundingKind)
def test_reprompting_is_told_the_same_rules(kind: GroundingKind) -> None:
    now, model = situation(FAULT), ScriptedModel("m", reasonable)
    shown = context_finder(kind, grounding(), reactor().graph, reactor().namespace)
    agent = TeachingReprompting(briefing(model, reactor(), simulation(FAULT), shown=shown))
    refused = Revise(tuple(f for f in now.idle if not f.satisfied))
    asyncio.run(agent.advise(now, Attempt(1, None, None, refused), Advice()))
    assert all(prompt_file("rules", kind).strip() in q.system for q in model.asked) and model.asked


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind",
    [
        GroundingKind.GRAPH,
        *(pytest.param(k, marks=pytest.mark.wide) for k in GroundingKind if k != GroundingKind.GRAPH),
    ],
)
def test_a_run_recovers_under_each_kind(kind: GroundingKind) -> None:
    """With nobody but the model to propose: beside a search that finds something cheap it would not be asked."""
    model, trace = ScriptedModel("scripted:reasonable", reasonable), MemoryTrace()
    chosen = scenario(reactor(), "pump_degrade", 3, 2000.0, None, 2300.0)
    alone = Proposing(Language(model, grounding=kind), propose=model_alone)
    result = run(reactor(), chosen, trace, DeclaredClock(1.0), alone)
    assert result.good and result.actor == "language" and {q.agent for q in model.asked} >= {"planning", "action"}
    forms = {e.form for e in trace.of(Retrieved)}
    assert forms >= {"SELECT", "ASK"}, "what the agents that calculate ask stays the same"
    assert forms - {"SELECT", "ASK"} == {GRAPH: {"CONSTRUCT"}, DOCUMENTS: {"BM25"}, NONE: set()}[kind]
    for question in model.asked:
        if question.agent in ("planning", "action"):
            assert ("Turtle" in question.system, "# Plant" in question.prompt) == (kind is GRAPH, kind is not NONE)


def test_asking_step_by_step_is_grounded_alike() -> None:
    for kind in GroundingKind:
        told = asked(kind, FAULT)["step"].system
        assert ("the graph says" in told, "the documents say" in told) == (kind is GRAPH, kind is DOCUMENTS)
