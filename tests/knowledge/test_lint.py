"""Lint of small graphs written for the purpose: each kind is found by name, and its sound neighbour is not."""

from __future__ import annotations

import pytest
from pyoxigraph import NamedNode, RdfFormat

from homeostat.knowledge.checks.lint import lint
from homeostat.knowledge.checks.statements import SHOWN
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.error import Code, Mistake
from homeostat.knowledge.vocabulary.vocabulary import PREFIXES
from homeostat.plants.files.graph import open_graph
from homeostat.plants.files.places import plant_folder

HEAD = "".join(f"@prefix {name}: <{iri}> .\n" for name, iri in PREFIXES) + (
    "@prefix owl: <http://www.w3.org/2002/07/owl#> .\n@prefix : <urn:plant#> .\n"
)
MACHINE = """
:machine a UML:StateMachine ; UML:containsState :idle, :busy ; UML:containsTransition :start .
:idle a UML:State ; hs:isInitialState true .
:busy a UML:State ; hs:isInitialState false .
:start a UML:Transition ; UML:sourceState :idle ; UML:targetState :busy ; UML:transitionGuard "L1 > 2" .
"""


def found(text: str) -> tuple[Mistake, ...]:
    store = EmbeddedStore()
    store.load((HEAD + text).encode(), RdfFormat.TURTLE)
    return lint(store)


def only(text: str) -> Mistake:
    (finding,) = found(text)
    return finding


def test_our_own_graph_has_none() -> None:
    assert lint(open_graph((plant_folder("cstr") / "plant.ttl").read_bytes())) == ()


def test_a_sound_graph_has_none() -> None:
    assert found(MACHINE) == ()
    assert found("") == ()


def test_one_graph_of_several_is_looked_at() -> None:
    store = EmbeddedStore()
    graph = NamedNode("urn:graph")
    store.load((HEAD + ":a hs:feeds :b .").encode(), RdfFormat.TURTLE, graph)
    assert len(lint(store, graph)) == 1 and lint(store) == ()


def test_a_reference_to_nothing() -> None:
    text = ":opens a UML:Action ; CPSMod:isChangedByActuator :valve_b2 . :valve_1 a VDI2206:Actuator ."
    assert only(text).code is Code.DANGLING_REFERENCE
    assert str(only(text)) == (
        "[dangling-reference] individual 'valve_b2': nothing is said about it, but 'opens' refers to it by "
        "'CPSMod:isChangedByActuator'; describe it or correct the reference; did you mean 'valve_1'?"
    )


def test_a_reference_that_differs_in_case_only_is_named_as_such() -> None:
    text = (
        ":a CPSMod:isChangedByActuator :valve_b2 . :c CPSMod:isChangedByActuator :valve_b2 . :valve_B2 rdfs:label 'V' ."
    )
    assert str(only(text)) == (
        "[dangling-reference] individual 'valve_b2': nothing is said about it, but 'a' and 1 more refer to it by "
        "'CPSMod:isChangedByActuator'; write 'valve_B2', which differs in case only"
    )


@pytest.mark.parametrize(
    "text",
    [
        ":a hs:feeds :b . :b rdfs:label 'B' .",
        ":a hs:feeds <https://example.org/catalogue#pump> .",
        ":a rdfs:seeAlso :nothing ; owl:sameAs :else .",
        ":Kind a owl:Class ; rdfs:subClassOf :Other . :a a :Kind .",
    ],
    ids=["described", "foreign", "no statement about the plant", "vocabulary"],
)
def test_what_is_no_reference_to_nothing(text: str) -> None:
    assert found(text) == ()


@pytest.mark.parametrize(
    ("term", "instead"),
    [
        ("VDI3682:isAssignedto", "'VDI3682:isAssignedTo', which differs in case only"),
        ("hs:priorProbabilty", "'hs:priorProbability'"),
        ("VDI2206:hasInterface:Interface12", "'VDI2206:hasInterface'"),
        ("UML:source", "'UML:sourceState'"),
        ("<http://www.w3id.org/hsu-aut/VDI2206#consists_of>", "'VDI2206:consistsOf'"),
    ],
    ids=["case", "misspelt", "glued", "bridged", "renamed"],
)
def test_a_property_that_no_vocabulary_declares(term: str, instead: str) -> None:
    finding = only(f":a {term} 1 .")
    assert finding.code is Code.UNKNOWN_TERM
    assert finding.message == f"no vocabulary declares it, but 'a' uses it; write {instead}"


def test_a_class_that_no_vocabulary_declares() -> None:
    assert str(only(":a a VDI2206:Aktuator ; a VDI2206:actuator .")) == (
        "[unknown-term] class 'VDI2206:actuator': no vocabulary declares it, but 'a' uses it; "
        "write 'VDI2206:Actuator', which differs in case only"
    )


@pytest.mark.parametrize(
    "text",
    [
        ":a VDI3682:isAssignedto 1 . VDI3682:isAssignedto a owl:DatatypeProperty .",
        ":a <https://example.org/other#isAssignedTo> 1 .",
        ":a sosa:hosts 1 .",
        ":a rdfs:isDefinedBy 1 .",
    ],
    ids=["declared in the graph", "foreign vocabulary", "like no other", "language"],
)
def test_what_is_no_unknown_term(text: str) -> None:
    assert found(text) == ()


def test_swapped_prefixes() -> None:
    text = ":s1 :hasInformationInterface VDI2206:Interface28 . :Interface28 a VDI2206:InformationInterface ."
    assert [str(finding) for finding in found(text)] == [
        "[swapped-prefix] property 'urn:plant#hasInformationInterface': no vocabulary declares it, but 's1' uses it; "
        "write 'VDI2206:hasInformationInterface', which has the same name in another namespace",
        "[swapped-prefix] individual 'VDI2206:Interface28': nothing is said about it, but 's1' refers to it by "
        "'urn:plant#hasInformationInterface'; write 'urn:plant#Interface28', which has the same name in another "
        "namespace",
    ]


def test_a_transition_without_guard_and_event() -> None:
    bare = MACHINE.replace('; UML:transitionGuard "L1 > 2"', "")
    for text in (bare, MACHINE.replace("L1 > 2", " ")):
        assert str(only(text)) == (
            "[transition-without-condition] transition 'start': has neither guard nor event, so nothing says when it "
            "is taken; state one, or the guard true"
        )
    assert found(bare + ":start UML:transitionEvent :full . :full a UML:Event .") == ()


def test_a_machine_without_an_initial_state() -> None:
    none = MACHINE.replace("isInitialState true", "isInitialState false")
    assert str(only(none)) == (
        "[bad-initial-state] state machine 'machine': marks no state as initial, so nothing says where it starts; give "
        "hs:isInitialState true to one of its states"
    )
    assert found(none + ":machine UML:initialState :idle .") == ()
    both = only(MACHINE.replace("isInitialState false", "isInitialState true"))
    assert both.code is Code.BAD_INITIAL_STATE and "2 states as initial: 'busy', 'idle'" in both.message


def test_a_component_that_was_left_out() -> None:
    pumps = "".join(f":p{n} a VDI2206:Actuator ; VDI2206:hasMechanicalInterface :i . " for n in range(3))
    text = pumps + ":i a VDI2206:MechanicalInterface . :p9 a VDI2206:Actuator . :s a VDI2206:Sensor ."
    assert str(only(text)) == (
        "[unreached-component] actuator 'p9': has no interface (3 of its 3 siblings have one); state what it is tied to"
    )
    assert found(text + ":p9 VDI2206:hasInterface :i .") == ()
    assert len(found(text + ":p0 hs:feeds :p1 .")) == 1  # most of them feed nothing


def test_either_end_of_a_connection_counts() -> None:
    text = (
        ":a a VDI2206:Component ; hs:feeds :b . :b a VDI2206:Component ; hs:isConnectedTo :c . :c a VDI2206:Component ."
    )
    assert found(text) == ()
    more = only(text + ":d a VDI2206:Component .")
    assert (more.code, more.thing) == (Code.UNREACHED_COMPONENT, "component 'd'")
    assert more.message == "has no connection (3 of its 3 siblings have one); state what it is tied to"


def test_a_class_without_any_link_or_without_siblings_is_left_alone() -> None:
    assert found(":a a VDI2206:Sensor . :b a VDI2206:Sensor . :c a VDI2206:Actuator .") == ()


def test_a_vocabulary_inside_the_graph_is_no_plant() -> None:
    text = "UML:Transition a owl:Class ; rdfs:subClassOf [ a owl:Restriction ; owl:onProperty UML:sourceStat ] ."
    assert found(text + "[] rdf:first UML:Nothing ; rdf:rest rdf:nil .") == ()


@pytest.mark.parametrize("kind", ["owl:NamedIndividual", "owl:Thing"])
def test_an_individual_that_is_declared_as_one_is_no_vocabulary(kind: str) -> None:
    assert only(f":start a {kind}, UML:Transition .").code is Code.TRANSITION_WITHOUT_CONDITION


def test_things_without_a_name_are_looked_at_too() -> None:
    assert only("[] a UML:Transition .").thing == "transition '(no name)'"


def test_a_name_cannot_disturb_the_line_it_is_shown_in() -> None:
    (finding,) = found(f":a hs:feeds <urn:plant#{'x' * 500}\\u202E> .")
    assert len(finding.thing) <= SHOWN + 20 and str(finding).isprintable()
