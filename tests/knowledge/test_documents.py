"""Documents tell the same facts as the Turtle that agents are shown, in plain words, and never as an instruction."""

from __future__ import annotations

import functools
import re

import pytest
from pyoxigraph import Literal, NamedNode, Triple

from homeostat.domain.quotation import quoted
from homeostat.knowledge.context.context import TEXT_LIMIT
from homeostat.knowledge.context.documents import Document, LexicalIndex, documents, words
from homeostat.knowledge.questions.query import template
from homeostat.knowledge.vocabulary.vocabulary import PREFIXES, RDF
from homeostat.plants.plant import Plant, load_plant
from tests.safety.injections import CORPUS, Injection
from tests.safety.poisoned_plant import poisoned
from tests.twin.followed import reactor

PLANTS = ["cstr", "mixing_module"]
TURTLE = re.compile(rf"\b(?:{'|'.join(prefix for prefix, _ in PREFIXES)}):\w|(?:^|\s):\w|\burn:|https?://|\^\^|@prefix")
"""What only Turtle has."""


@pytest.fixture(scope="module", params=PLANTS)
def plant(request: pytest.FixtureRequest) -> Plant:
    return load_plant(request.param)


@pytest.fixture(scope="module")
def told(plant: Plant) -> dict[str, Document]:
    return {document.name: document for document in documents(plant.graph, plant.namespace)}


def shown_as_turtle(plant: Plant) -> set[Triple]:
    """Everything that planning, acting and acting in one step can be shown, with every fault and in every state."""
    machine, ns = plant.description.machine, plant.namespace
    faults = tuple(NamedNode(f"{ns}fault_{fault.name}") for fault in plant.description.faults)
    states = tuple(NamedNode(f"{ns}state_{state.name}") for state in machine.states)
    event = NamedNode(f"{ns}event_{machine.recovery_event}")
    found = set(template("planning_fragment").construct(plant.graph, states=states, event=event, faults=faults))
    found |= set(template("action_fragment").construct(plant.graph, states=states, faults=faults))
    for state in states:
        found |= set(template("step_fragment").construct(plant.graph, state=state, faults=faults))
    return found


def test_every_fact_of_the_turtle_is_in_the_document_of_the_same_thing(plant: Plant, told: dict[str, Document]) -> None:
    facts = shown_as_turtle(plant)
    assert len(facts) > 300
    for fact in facts:
        assert isinstance(fact.subject, NamedNode)
        if fact.predicate.value.endswith("#isBlockedBy"):
            continue  # what the query concludes: the state says what it requires, the fault what it disables
        text = told[fact.subject.value.removeprefix(plant.namespace)].text
        if isinstance(fact.object, Literal):
            assert quoted(fact.object.value, TEXT_LIMIT) in text, fact
        elif fact.predicate != RDF.type:
            assert isinstance(fact.object, NamedNode)
            name = fact.object.value.removeprefix(plant.namespace)
            assert name.partition("_")[2] in text, fact


def test_a_document_is_one_line_of_plain_words(told: dict[str, Document]) -> None:
    for document in told.values():
        assert document.text.isprintable() and document.text.endswith(".")
        assert document.text.count("«") == document.text.count("»")
        assert not TURTLE.search(document.text), document.text


def test_every_thing_that_is_named_has_a_document(plant: Plant, told: dict[str, Document]) -> None:
    d = plant.description
    expected = {f"state_{s.name}" for s in d.machine.states} | {f"fault_{f.name}" for f in d.faults}
    expected |= {f"tag_{tag}" for tag in d.tags_by_name} | {f"limit_{limit.name}" for limit in d.limits.hard}
    assert expected <= told.keys()
    assert not any(name.startswith(("table_", "type_", "value_")) or ".list" in name for name in told)


def test_how_a_document_reads() -> None:
    plant = load_plant("cstr")
    told = {document.name: document.text for document in documents(plant.graph, plant.namespace)}
    assert told["limit_LIM-T-HIGH"] == (
        "Interlock and limit LIM-T-HIGH. «Highest reactor temperature». Constrains T1. Formula «T1 <= 313». "
        "Hard true. Source «Operating envelope OE-1»."
    )
    assert told["range_compensated_L1.sp"] == (
        "Setpoint range compensated_L1.sp. Default 10. High 10.4. Low 6. Of tag L1.sp."
    )
    assert "Affects and disables V2." in told["fault_cool_stuck_closed"]


@functools.cache
def saying(text: str) -> tuple[Document, ...]:
    """The documents of the reactor that says ``text`` everywhere."""
    plant = poisoned(reactor(), text)
    return documents(plant.graph, plant.namespace)


@pytest.mark.parametrize(
    "injection", [pytest.param(i, id=i.name, marks=pytest.mark.wide if k % 3 else []) for k, i in enumerate(CORPUS)]
)
def test_a_text_of_the_plant_is_quoted(injection: Injection) -> None:
    outside = re.compile("«[^»]*»")
    for document, like in zip(saying(injection.text), saying("Pump"), strict=True):
        assert document.text.isprintable() and document.text.count("«") == document.text.count("»")
        assert outside.sub("«»", document.text) == outside.sub("«»", like.text), "nothing of it is outside quotes"


# --- finding them -----------------------------------------------------------------------------------------------


def test_the_best_document_comes_first_and_equals_by_name() -> None:
    index = LexicalIndex(
        [
            Document("b", "", "The pump is blocked."), Document("a", "", "The pump is blocked."),
            Document("c", "", "The valve is blocked."), Document("d", "", "A vessel."),
        ]
    )  # fmt: skip
    assert [d.name for d in index.matching("blocked pump")] == ["a", "b", "c"]
    assert index.matching("nothing of this") == ()


def test_a_name_is_found_as_a_whole_before_its_parts(told: dict[str, Document], plant: Plant) -> None:
    index = LexicalIndex(tuple(told.values()))
    for fault in plant.description.faults:
        assert fault.name in index.matching(f"fault {fault.name} {fault.label}")[0].text
    assert words("Level_bias, T1.sp and S-HOT.") == [
        "level_bias", "level", "bias", "t1.sp", "t1", "sp", "s-hot", "s", "hot",
    ]  # fmt: skip
