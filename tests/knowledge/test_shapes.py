"""Every shape can be broken, and says so in its own words."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from importlib import resources

import pytest
from pyoxigraph import Literal, NamedNode, Quad, RdfFormat, Store

from homeostat.knowledge.checks.conformance import check_shapes
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.tbox import ontologies
from homeostat.knowledge.vocabulary.vocabulary import DIN17359, HS, PREFIXES, RDF, RDFS, UML, VDI2206, VDI3682
from tests.knowledge.tables import reactor, store_of

SHAPES = sorted(
    (
        file
        for file in resources.files("homeostat.knowledge.checks").joinpath("shapes").iterdir()
        if file.name.endswith(".ttl")
    ),
    key=lambda file: file.name,
)
CSTR = "<urn:homeostat:cstr#"
PREAMBLE = "".join(f"PREFIX {name}: <{iri}>\n" for name, iri in PREFIXES) + "PREFIX sh: <http://www.w3.org/ns/shacl#>\n"


@dataclass(frozen=True)
class Rule:
    """One property shape on a class: what it is about and what it says when it is broken."""

    kind: NamedNode
    path: NamedNode
    message: str


def rules(constraint: str) -> list[Rule]:
    """The property shapes with a simple path, on a class, that have a constraint."""
    store = EmbeddedStore()
    for file in SHAPES:
        store.load(file.read_bytes(), RdfFormat.TURTLE)
    rows = store.select(
        f"{PREAMBLE} SELECT ?kind ?path ?message {{ ?shape sh:targetClass ?kind ; sh:property ?p . "
        f"?p sh:path ?path ; {constraint} ; sh:message ?message FILTER(isIRI(?path)) "
        "FILTER NOT EXISTS { ?p sh:qualifiedValueShape [] } } ORDER BY ?kind ?path ?message"
    )
    return [Rule(row.iri("kind"), row.iri("path"), row.text("message")) for row in rows]


def complete_reactor() -> bytes:
    """The reactor's graph with an instance of every class that has a shape: none of its fallbacks needs a waiver."""
    waiver = f"""
        {CSTR}waiver_drain_PRM-FEED> a {HS.Waiver} ; {HS.belongsTo} {CSTR}system> ; {HS.name} "drain" ;
            {HS.ofStrategy} {CSTR}fallback_drain> ; {HS.waives} {CSTR}limit_PRM-FEED> ; {RDFS.comment} "A reason"@en .
    """
    return reactor() + waiver.encode()


@pytest.fixture
def store() -> EmbeddedStore:
    return store_of(complete_reactor())


@functools.cache
def with_vocabulary() -> Store:
    """The reactor's graph beside the ontologies; nobody writes to it."""
    graph = Store()
    graph.load(complete_reactor(), format=RdfFormat.TURTLE)
    for _, text in ontologies():
        graph.load(text, format=RdfFormat.TURTLE)
    return graph


@functools.cache
def first_of(kind: NamedNode) -> NamedNode:
    """An instance of a class in the reactor's graph, subclasses included."""
    found = with_vocabulary().query(f"{PREAMBLE} SELECT ?x {{ ?x a/rdfs:subClassOf* {kind} }} ORDER BY ?x LIMIT 1")
    (node,) = (solution["x"] for solution in found)  # type: ignore[union-attr]
    assert isinstance(node, NamedNode)
    return node


def said(store: GraphStore) -> set[tuple[str, str]]:
    """Which thing is wrong, and how, for every violation."""
    return {(violation.focus, violation.message) for violation in check_shapes(store)}


def local(node: NamedNode) -> str:
    return node.value.rpartition("#")[2]


def test_the_committed_graph_conforms(store: EmbeddedStore) -> None:
    assert check_shapes(store) == ()


def test_every_value_that_must_be_there_is_missed(store: EmbeddedStore) -> None:
    wanted = rules("sh:minCount ?n")
    assert len(wanted) > 60
    expected = {(local(first_of(rule.kind)), rule.message) for rule in wanted}
    for rule in wanted:
        store.update(f"DELETE WHERE {{ {first_of(rule.kind)} {rule.path} ?value }}")
    assert expected - said(store) == set()


def test_every_second_value_of_what_there_is_one_of_is_seen(store: EmbeddedStore) -> None:
    wanted = rules("sh:maxCount 1")
    assert len(wanted) > 60
    expected = {(local(first_of(rule.kind)), rule.message) for rule in wanted}
    for rule in wanted:
        thing = first_of(rule.kind)
        for other in ('"one thing too many"', "<urn:x#1>", "<urn:x#2>"):
            store.update(f"INSERT DATA {{ {thing} {rule.path} {other} }}")
    assert expected - said(store) == set()


def test_every_number_must_be_one(store: EmbeddedStore) -> None:
    wanted = rules("sh:datatype xsd:double")
    assert len(wanted) > 15
    expected = {(local(first_of(rule.kind)), rule.message) for rule in wanted}
    for rule in wanted:
        store.update(
            f"DELETE {{ ?x {rule.path} ?old }} INSERT {{ ?x {rule.path} 'many' }} "
            f"WHERE {{ BIND({first_of(rule.kind)} AS ?x) OPTIONAL {{ ?x {rule.path} ?old }} }}"
        )
    assert expected - said(store) == set()


BREAKS = [
    ("DELETE WHERE { ?x a VDI2206:Sensor }", "must be a System, Module, Component"),
    ("DELETE WHERE { ?x VDI2206:isPartOf ?y }", "must be part of something"),
    ("INSERT DATA { <urn:x#ghost> hs:hasParameter <urn:x#p> }", "no row in the equipment table"),
    ("INSERT DATA { <urn:x#ghost> VDI3682:hasInput <urn:x#p> }", "no row in the operator table"),
    ("INSERT DATA { <urn:x#ghost> hs:requiresComponent <urn:x#p> }", "no row in the state table"),
    ("INSERT DATA { <urn:x#ghost> DIN17359:SymptomIndicatesFault <urn:x#p> }", "no row in the symptom table"),
    ("DELETE { ?x a ?k } WHERE { VALUES ?k { hs:TripLimit hs:Permissive } ?x a ?k }", "must be a trip limit"),
    ("DELETE WHERE { ?x hs:drives ?y }", "needs a tag that drives it"),
    ("DELETE WHERE { ?x sosa:observes ?y }", "needs a tag that it measures"),
    ("DELETE { ?x hs:role ?r } INSERT { ?x hs:role 'PV' } WHERE { ?x hs:drives ?y ; hs:role ?r }", "needs role MV"),
    ("DELETE { ?x hs:role ?r } INSERT { ?x hs:role 'PV' } WHERE { ?x hs:sets ?y ; hs:role ?r }", "needs role SP"),
    (
        "DELETE { ?x hs:rangeLow ?a } INSERT { ?x hs:rangeLow ?b } WHERE { ?x hs:rangeLow ?a ; hs:rangeHigh ?b }",
        "below",
    ),
    ("DELETE { ?x hs:scale ?a } INSERT { ?x hs:scale 0.0e0 } WHERE { ?x hs:scale ?a }", "one scale > 0"),
    (
        "DELETE { ?x hs:isInitialState ?a } INSERT { ?x hs:isInitialState true } WHERE { ?x hs:isInitialState ?a }",
        "one ini",
    ),
    (
        "DELETE { ?x hs:isInitialState ?a } INSERT { ?x hs:isInitialState false } WHERE { ?x hs:isInitialState ?a }",
        "one in",
    ),
    ("DELETE WHERE { ?x hs:isRecoveryTarget true }", "a recovery may end in"),
    ("DELETE { ?x hs:window ?a } INSERT { ?x hs:window 5.0e0 } WHERE { ?x hs:window ?a }", "a balance needs"),
    ("DELETE { ?x hs:window ?a } INSERT { ?x hs:window 0.0e0 } WHERE { ?x hs:window ?a }", "a balance needs"),
    ("DELETE { ?x hs:low ?a } INSERT { ?x hs:low 1.0e9 } WHERE { ?x hs:low ?a }", "not above its high end"),
    ("DELETE WHERE { ?x hs:allowsSetpoint ?y }", "a setpoint range needs one state"),
    ("DELETE WHERE { ?x DIN17359:FaultIsDescribedBySymptom ?y }", "needs a symptom that indicates it"),
    ("DELETE { ?x hs:hard ?a } INSERT { ?x hs:hard 'yes' } WHERE { ?x hs:hard ?a }", "one yes or no: hard"),
    ("DELETE WHERE { ?x hs:writes ?y }", "a fallback command needs one known tag"),
    ("DELETE WHERE { ?x CPSMod:processRealizesBehavior ?y }", "an equation needs one process operator"),
    ("INSERT { ?x hs:sd 1.0e0 } WHERE { ?x hs:relativeUncertainty ?y }", "one uncertainty >= 0"),
    (
        "DELETE { ?x hs:name ?n } INSERT { ?x hs:name 'T 1' } WHERE { ?x a hs:Tag ; hs:name ?n }",
        "that formulas can use",
    ),
]


@pytest.mark.parametrize(("update", "words"), BREAKS)
def test_a_broken_graph_is_told_what_it_lacks(store: EmbeddedStore, update: str, words: str) -> None:
    store.update(PREAMBLE + update)
    violations = check_shapes(store)
    assert any(words in violation.message for violation in violations)
    assert all("\n" not in str(violation) and violation.focus in str(violation) for violation in violations)


def test_a_named_graph_is_checked_by_name(store: EmbeddedStore) -> None:
    name = NamedNode("urn:homeostat:graph:cstr")
    named = EmbeddedStore()
    named.load(store.dump(RdfFormat.N_TRIPLES), RdfFormat.N_TRIPLES, name)
    assert check_shapes(named, name) == ()
    named.update(f"DELETE WHERE {{ GRAPH {name} {{ ?x {HS.unit} ?y }} }}")
    assert {violation.path for violation in check_shapes(named, name)} == {"unit"}
    assert check_shapes(named) == (), "the default graph is empty"


def test_things_of_a_subclass_are_checked_too() -> None:
    graph = Store()
    odd = NamedNode("urn:x#flow")
    graph.add(Quad(odd, RDF.type, VDI3682.Energy))
    graph.add(Quad(NamedNode("urn:x#a"), RDF.type, VDI2206.Actuator))
    graph.add(Quad(NamedNode("urn:x#t"), RDF.type, UML.Transition))
    graph.add(Quad(NamedNode("urn:x#f"), RDF.type, DIN17359.Fault))
    graph.add(Quad(NamedNode("urn:x#f"), HS.priorProbability, Literal(1.5)))
    found = said(store_of(graph.dump(format=RdfFormat.TURTLE, from_graph=next(iter(graph)).graph_name)))
    assert ("flow", "a flow must be an input or output of an operator") in found
    assert ("a", "an actuator needs a tag that drives it") in found
    assert ("t", "a transition needs one guard; write true where it may always be taken") in found
    assert ("f", "a fault needs one prior in (0, 1]") in found
