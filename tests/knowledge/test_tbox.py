"""The T-Box: every term we use is the published one, said once, explained, and free of contradiction.

The list of the published terms is not part of this project. Without it some terms that are stated here are compared,
and a digest tells whether any term was changed since all were compared with the list.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest
import rdflib
from pyoxigraph import NamedNode, RdfFormat

from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.vocabulary import vocabulary
from homeostat.knowledge.vocabulary.namespace import ClosedNamespace
from homeostat.knowledge.vocabulary.tbox import COMPAT_GRAPH, ONTOLOGY_GRAPH, bridge, load_ontology, ontologies
from homeostat.knowledge.vocabulary.vocabulary import DIN17359, HS, PREFIXES, QUDT, RDF, RDFS, SOSA, UML, VDI3682, XSD

PUBLISHED: Final = Path(__file__).parents[3] / "shared/data/reference/ontology_terms.json"
TERMS = pytest.mark.reference("the list of published terms (some are stated in this module)", PUBLISHED)
WHOLE: Final = {"VDI2206", "VDI3682", "UML", "DIN17359", "M", "CPSMod"}
"""Prefixes of the vocabularies that are taken over whole; of the others we take a part."""
OWL: Final = "http://www.w3.org/2002/07/owl#"
SCHEMA: Final = "https://schema.org/"
KINDS: Final = {
    "C": OWL + "Class",
    "C(rdfs)": RDFS.iri + "Class",
    "OP": OWL + "ObjectProperty",
    "DP": OWL + "DatatypeProperty",
}
OURS: Final = tuple(iri for prefix, iri in PREFIXES if prefix not in ("rdf", "rdfs", "xsd"))
PREAMBLE: Final = "".join(f"PREFIX {prefix}: <{iri}>\n" for prefix, iri in PREFIXES) + f"PREFIX owl: <{OWL}>\n"
NAMESPACES: Final = tuple(item for item in vars(vocabulary).values() if isinstance(item, ClosedNamespace))


@pytest.fixture(scope="module")
def tbox() -> EmbeddedStore:
    """The T-Box and the bridges."""
    store = EmbeddedStore()
    load_ontology(store)
    return store


@pytest.fixture(scope="module")
def terms(tbox: EmbeddedStore) -> EmbeddedStore:
    """The T-Box, without the bridges, as the default graph."""
    return tbox.seeing(ONTOLOGY_GRAPH)


def pairs(store: EmbeddedStore, pattern: str) -> set[tuple[str, str]]:
    """The bindings of ?a and ?b in ``pattern``, where both are IRIs."""
    rows = store.select(f"{PREAMBLE} SELECT DISTINCT ?a ?b {{ {pattern} FILTER(isIRI(?a) && isIRI(?b)) }}")
    return {(row.iri("a").value, row.iri("b").value) for row in rows}


def kinds(store: EmbeddedStore) -> dict[str, str]:
    """Every declared term of our files and what it is declared as."""
    declared = [(a, b) for a, b in pairs(store, "?a a ?b") if b in KINDS.values()]
    assert [term for term, count in Counter(term for term, _ in declared).items() if count > 1] == []
    return dict(declared)


# ---------------------------------------------------------------- against what is published


STATED: Final = (
    ("VDI2206", "VDI2206:Module", "C", "", "", "VDI2206:BasicSystem", ""),
    ("VDI2206", "VDI2206:Actuator", "C", "", "", "VDI2206:Component", ""),
    ("VDI2206", "VDI2206:hasInterface", "OP", "(VDI2206:Component ∪ VDI2206:Module)", "VDI2206:Interface", "", ""),
    ("VDI2206", "VDI2206:ComponentIsPartOfModule", "OP", "VDI2206:Component", "VDI2206:Module", "VDI2206:isPartOf",
     "VDI2206:ModuleConsistsOfComponent"),
    ("VDI3682", "VDI3682:hasInput", "OP", "(VDI3682:Process ∪ VDI3682:ProcessOperator)", "VDI3682:State",
     "VDI3682:flow", ""),
    ("VDI3682", "VDI3682:isAssignedTo", "OP", "VDI3682:ProcessOperator", "VDI3682:TechnicalResource", "", ""),
    ("UML", "UML:Transition", "C", "", "", "", ""),
    ("UML", "UML:sourceState", "OP", "UML:Transition", "UML:State", "", ""),
    ("UML", "UML:containsState", "OP", "UML:StateMachine", "UML:State", "", ""),
    ("UML", "UML:transitionGuard", "DP", "UML:Transition", "xsd:string", "", ""),
    ("DIN17359", "DIN17359:SymptomIndicatesFault", "OP", "DIN17359:Symptom", "DIN17359:Fault", "",
     "DIN17359:FaultIsDescribedBySymptom"),
    ("SOSA", "sosa:hosts", "OP", "", "", "", "sosa:isHostedBy"),
    ("OpenMath", "M:Application", "C", "", "", "M:Compound", ""),
    ("CPSMod", "CPSMod:isChangedByActuator", "OP", "VDI3682:State", "(VDI2206:Actuator ∪ sosa:Actuator)", "", ""),
)  # fmt: skip
"""Some terms as their ontologies state them: ontology, name, kind, domain, range, what it is below, its inverse."""
TAKEN: Final = {
    "M": 27,
    "VDI3682": 30,
    "sosa": 23,
    "DINEN61360": 35,
    "UML": 16,
    "VDI2206": 35,
    "CPSMod": 11,
    "DIN17359": 54,
    "qudt": 5,
}
"""Terms of each published vocabulary that are here."""
COMPARED: Final = "a3d58b3e3ecb41bf38ec89a76203d1d5d3e73a2d2b725db43dd65b8ba76fc456"
"""What :func:`digest` gave when the terms were last compared with the whole published list."""


@dataclass(frozen=True)
class Published:
    """What the published ontologies declare."""

    rows: list[dict[str, Any]]
    """One term of one ontology each."""
    whole: bool
    """Whether this is the published list; otherwise :data:`STATED`."""

    def used(self, terms: dict[str, str]) -> list[dict[str, Any]]:
        """The terms of the parts that we use."""
        return [row for row in self.rows if row["curie"].split(":")[0] in WHOLE or row["iri"] in terms]


@pytest.fixture(scope="module", params=["stated here", pytest.param("published list", marks=TERMS)])
def published(request: pytest.FixtureRequest) -> Published:
    """Some terms, and where it is there the list of all."""
    if request.param == "published list":
        return Published(json.loads(PUBLISHED.read_text("utf-8")), whole=True)
    names = ("domain", "range", "sub", "inverse")
    return Published([
        {"ontology": ontology, "curie": curie, "kind": kind, "iri": expand(curie)}
        | {name: [text] if text else [] for name, text in zip(names, said, strict=True)}
        for ontology, curie, kind, *said in STATED
    ], whole=False)  # fmt: skip


def digest(terms: EmbeddedStore) -> str:
    """Hash of what is said of the published terms: kinds, domains, ranges, hierarchies, inverses, enumerations."""
    member = "(owl:unionOf/(rdf:rest*)/rdf:first)?"
    patterns = (
        "?a a ?b", "?a rdfs:subClassOf|rdfs:subPropertyOf ?b", "?a owl:inverseOf ?b",
        f"?a rdfs:domain|<{SCHEMA}domainIncludes> ?x . ?x {member} ?b",
        f"?a rdfs:range|<{SCHEMA}rangeIncludes> ?x . ?x {member} ?b",
    )  # fmt: skip
    said = {f"{n} {a} {b}" for n, pattern in enumerate(patterns) for a, b in pairs(terms, pattern) if ours(a)}
    literals = terms.select(f"{PREAMBLE} SELECT ?a ?v {{ ?a rdfs:range/owl:oneOf/(rdf:rest*)/rdf:first ?v }}")
    said |= {f"one of {a.value} {row.text('v')}" for row in literals if ours((a := row.iri("a")).value)}
    return hashlib.sha256("\n".join(sorted(said)).encode()).hexdigest()


def ours(iri: str) -> bool:
    """Whether a term is of a published vocabulary that we use."""
    return iri.startswith(OURS) and not iri.startswith(HS.iri)


def test_what_was_compared_with_the_published_list_is_what_is_here(terms: EmbeddedStore) -> None:
    """A term that is changed must be compared again, with the list: then the digest below is the new one."""
    prefixes = {iri: prefix for prefix, iri in PREFIXES}
    counts = Counter(prefixes[term[: max(term.rfind("#"), term.rfind("/")) + 1]] for term in kinds(terms) if ours(term))
    assert counts == TAKEN
    assert digest(terms) == COMPARED


def test_every_published_term_of_the_parts_used_is_there_with_its_kind(
    terms: EmbeddedStore, published: Published
) -> None:
    found = kinds(terms)
    used = published.used(found)
    assert {row["curie"]: found.get(row["iri"]) for row in used} == {row["curie"]: KINDS[row["kind"]] for row in used}
    assert len({row["iri"] for row in used}) > 200 or not published.whole


@TERMS
def test_nothing_is_added_to_a_published_namespace(terms: EmbeddedStore) -> None:
    """Without the list: ``test_what_was_compared_with_the_published_list_is_what_is_here``. QUDT is not in it."""
    known = {row["iri"] for row in json.loads(PUBLISHED.read_text("utf-8"))}
    added = {term for term in kinds(terms) if not term.startswith((HS.iri, QUDT.iri))} - known
    assert added == set()


@pytest.mark.parametrize("side", ["domain", "range"])
def test_domains_and_ranges_agree_with_the_published_ones(
    terms: EmbeddedStore, published: Published, side: str
) -> None:
    member = "(owl:unionOf/(rdf:rest*)/rdf:first)?"
    stated = pairs(terms, f"?a rdfs:{side}|<{SCHEMA}{side}Includes> ?x . ?x {member} ?b")
    checked = 0
    for row in published.used(kinds(terms)):
        if not row[side]:
            continue
        names = set(re.findall(r"[A-Za-z0-9]+:\w+", " ".join(row[side])))
        mine = {b for a, b in stated if a == row["iri"] and not b.startswith(RDF.iri)}
        if "{" in row[side][0]:  # an enumeration of literals: compared below
            continue
        if "[" in row[side][0]:  # an intersection with a restriction: we state its first, wider member
            names = set(re.findall(r"[A-Za-z0-9]+:\w+", row[side][0])[:1])
        assert mine == {expand(name) for name in names}, (row["curie"], side)
        checked += 1
    assert checked > ((90 if side == "domain" else 100) if published.whole else 7)


@TERMS
def test_enumerations_agree_with_the_published_ones(terms: EmbeddedStore) -> None:
    """Without the list: ``test_what_was_compared_with_the_published_list_is_what_is_here``."""
    for row in Published(json.loads(PUBLISHED.read_text("utf-8")), whole=True).used(kinds(terms)):
        if row["range"] and "{" in row["range"][0]:
            query = f"SELECT ?v {{ <{row['iri']}> rdfs:range/owl:oneOf/(rdf:rest*)/rdf:first ?v }}"
            mine = {answer.text("v") for answer in terms.select(PREAMBLE + query)}
            assert mine == set(re.findall(r"'([^']*)'", row["range"][0])), row["curie"]


def test_hierarchies_and_inverses_agree_with_the_published_ones(terms: EmbeddedStore, published: Published) -> None:
    found = kinds(terms)
    above = pairs(terms, "?a rdfs:subClassOf|rdfs:subPropertyOf ?b")
    inverse = pairs(terms, "?a owl:inverseOf ?b")
    for row in published.used(found):
        named = [sup for sup in row["sub"] if re.fullmatch(r"[A-Za-z0-9]+:\w+", sup)]
        for sup in named:
            if not sup.startswith("owl:"):  # being below everything says nothing
                assert (row["iri"], expand(sup)) in above, (row["curie"], sup)
        for other in row["inverse"]:
            if expand(other) in found:
                assert (row["iri"], expand(other)) in inverse, (row["curie"], other)


def expand(curie: str) -> str:
    """The IRI of a prefixed name."""
    prefix, name = curie.split(":")
    return dict([*PREFIXES, ("owl", OWL)])[prefix] + name


def test_the_alignment_of_the_system_model_is_complete(terms: EmbeddedStore) -> None:
    sub = pairs(terms, "?a rdfs:subClassOf ?b")
    same = pairs(terms, "?a owl:equivalentClass ?b")
    for a, b in (
        ("VDI2206:BasicSystem", "sosa:FeatureOfInterest"),
        ("sosa:ObservableProperty", "DIN17359:Parameter"),
        ("sosa:ActuatableProperty", "DIN17359:Parameter"),
        ("M:Application", "VDI2206:MathematicalModel"),
        ("UML:StateMachine", "VDI2206:MathematicalModel"),
    ):
        assert (expand(a), expand(b)) in sub
    for a, b in (
        ("VDI2206:BasicSystem", "VDI3682:TechnicalResource"),
        ("VDI2206:BasicSystem", "DIN17359:DiagnosticSubject"),
        ("VDI2206:Sensor", "sosa:Sensor"),
        ("VDI2206:Actuator", "sosa:Actuator"),
    ):
        assert (expand(a), expand(b)) in same or (expand(b), expand(a)) in same


# ---------------------------------------------------------------- by itself


def test_every_term_is_explained_once_in_english(terms: EmbeddedStore) -> None:
    for term in kinds(terms):
        for predicate in ("label", "comment"):
            rows = terms.select(f"{PREAMBLE} SELECT ?text (LANG(?text) AS ?in) {{ <{term}> rdfs:{predicate} ?text }}")
            assert [row.text("in") for row in rows] == ["en"], (term, predicate)
            assert len(rows[0].text("text")) > 2


def test_every_property_of_ours_says_what_it_joins(terms: EmbeddedStore) -> None:
    ours = {term: kind for term, kind in kinds(terms).items() if term.startswith(HS.iri) and "Property" in kind}
    assert len(ours) > 90
    for term, kind in ours.items():
        for side in ("domain", "range"):
            (row,) = terms.select(f"{PREAMBLE} SELECT (COUNT(?x) AS ?n) {{ <{term}> rdfs:{side} ?x }}")
            assert row.number("n") == 1, (term, side)
        (datatype,) = terms.select(
            f"{PREAMBLE} SELECT (COUNT(?x) AS ?n) {{ <{term}> rdfs:range ?x "
            f"FILTER(STRSTARTS(STR(?x), '{XSD.iri}') || ?x = rdfs:Literal || EXISTS {{ ?x a rdfs:Datatype }}) }}"
        )
        assert (datatype.number("n") == 1) == kind.endswith("DatatypeProperty"), term


def test_every_term_that_is_mentioned_is_declared(tbox: EmbeddedStore) -> None:
    everything = tbox.seeing(ONTOLOGY_GRAPH, COMPAT_GRAPH)
    declared = set(kinds(everything))
    mentioned = {iri for pair in pairs(everything, "{ ?a ?p ?b } UNION { ?x ?a ?y . ?x ?b ?y }") for iri in pair}
    heads = {iri for iri, _ in pairs(everything, "?a a owl:Ontology . ?a a ?b")}
    assert {iri for iri in mentioned if iri.startswith(OURS)} - declared - heads == set()


def test_imports_lead_to_ontologies_of_this_package(tbox: EmbeddedStore) -> None:
    everything = tbox.seeing(ONTOLOGY_GRAPH, COMPAT_GRAPH)
    heads = {iri for iri, _ in pairs(everything, "?a a owl:Ontology . ?a a ?b")}
    assert len(heads) == len(ontologies()) == 11
    assert {b for _, b in pairs(everything, "?a owl:imports ?b")} <= heads


def test_nothing_is_the_same_as_another_thing() -> None:
    assert not [name for name, text in ontologies() if b"sameAs" in text]


def test_no_class_is_below_two_classes_that_exclude_each_other(terms: EmbeddedStore) -> None:
    below = pairs(terms, "?a (rdfs:subClassOf|owl:equivalentClass|^owl:equivalentClass)* ?b")
    member = "(owl:unionOf/(rdf:rest*)/rdf:first)?"
    apart = pairs(terms, f"?a owl:disjointWith ?x . ?x {member} ?b") | pairs(
        terms,
        "?x a owl:AllDisjointClasses ; owl:members ?l . ?l rdf:rest*/rdf:first ?a . ?l rdf:rest*/rdf:first ?b "
        "FILTER(?a != ?b)",
    )
    assert len(apart) > 25
    for term, kind in kinds(terms).items():
        if kind == OWL + "Class":
            above = {b for a, b in below if a == term}
            assert [(a, b) for a, b in apart if a in above and b in above] == [], term


def contradictions(tbox: EmbeddedStore, extra: str) -> list[str]:
    """What an OWL RL reasoner complains about, given one thing of every class and the statements ``extra``."""
    owlrl = pytest.importorskip("owlrl")
    graph = rdflib.Graph()
    for name in (ONTOLOGY_GRAPH, COMPAT_GRAPH):
        graph.parse(data=tbox.dump(RdfFormat.N_TRIPLES, name), format="nt")
    for kind in set(graph.subjects(rdflib.RDF.type, rdflib.OWL.Class)):
        if isinstance(kind, rdflib.URIRef):
            graph.add((rdflib.URIRef(f"urn:one:{kind}"), rdflib.RDF.type, kind))
    graph.parse(data=f"@prefix hs: <{HS.iri}> . {extra}", format="turtle")
    owlrl.DeductiveClosure(owlrl.OWLRL_Semantics).expand(graph)
    errors = rdflib.Namespace("http://www.daml.org/2002/03/agents/agent-ont#")
    assert len(graph) > 5000
    return [str(text) for text in graph.objects(None, errors.error)]


def test_reasoning_over_the_vocabulary_finds_no_contradiction(tbox: EmbeddedStore) -> None:
    assert contradictions(tbox, "") == []


def test_reasoning_finds_a_contradiction_where_there_is_one(tbox: EmbeddedStore) -> None:
    (complaint,) = contradictions(tbox, "<urn:both> a hs:TripLimit, hs:Permissive .")
    assert "TripLimit" in complaint and "urn:both" in complaint


# ---------------------------------------------------------------- as code sees it


@pytest.mark.parametrize("namespace", NAMESPACES, ids=lambda item: item.__name__)
def test_every_constant_is_a_term_of_the_vocabulary(terms: EmbeddedStore, namespace: ClosedNamespace) -> None:
    assert len(namespace.terms) == len(set(namespace.terms)) > 4
    for name in vars(namespace)["__annotations__"]:
        assert getattr(namespace, name) == NamedNode(namespace.iri + name) == namespace[name]
        assert namespace[name] in namespace
    if namespace.iri in OURS:
        assert {term.value for term in namespace} <= set(kinds(terms))


def test_every_term_of_ours_is_a_constant(terms: EmbeddedStore) -> None:
    assert {term for term in kinds(terms) if term.startswith(HS.iri)} == {term.value for term in HS}


def test_a_term_that_does_not_exist_cannot_be_named() -> None:
    with pytest.raises(AttributeError, match=r"'rateLimt' is not in namespace HS <urn:.*>; did you mean 'rateLimit'"):
        HS.rateLimt  # type: ignore[attr-defined]  # noqa: B018
    with pytest.raises(KeyError, match="did you mean 'containsState'"):
        UML["containState"]
    with pytest.raises(AttributeError, match="namespace HS is closed: 'newTerm' cannot be set"):
        HS.newTerm = NamedNode("urn:x")
    with pytest.raises(AttributeError, match="'Tag' cannot be set"):
        HS.Tag = HS.Limit
    assert NamedNode("urn:x") not in HS


def test_prefixes_are_those_of_the_files() -> None:
    known = dict(PREFIXES)
    for name, text in ontologies():
        for prefix, iri in re.findall(r"@prefix (\w+): +<([^>]+)>", text.decode()):
            assert known.get(prefix, iri) == iri, (name, prefix)


# ---------------------------------------------------------------- bridges


ODD_PLANT: Final = b"""
@prefix p: <urn:plant:> . @prefix UML: <http://www.hsu-ifa.de/ontologies/UMLStateMachine#> .
@prefix VDI3682: <http://www.w3id.org/hsu-aut/VDI3682#> . @prefix sosa: <http://www.w3.org/ns/sosa/> .
@prefix DIN17359: <http://www.hsu-ifa.de/ontologies/DIN17359#> .
p:t UML:source p:a ; UML:targetState p:b .
p:op VDI3682:isAssignedto p:m .
p:q a sosa:ActuableProperty .
p:feature DIN17359:IsUsedToIdentifySymptom p:symptom .
p:m DIN17359:DiagnosticSubjectHasFault p:fault .
"""


def test_bridges_say_odd_terms_again_in_defined_ones(tbox: EmbeddedStore) -> None:
    graph = NamedNode("urn:plant")
    tbox.load(ODD_PLANT, RdfFormat.TURTLE, graph)
    before = tbox.dump(RdfFormat.N_TRIPLES, graph)
    added = bridge(tbox, graph)
    triples = tbox.seeing(added).construct("CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }")
    p = "urn:plant:"
    assert {str(triple) for triple in triples} == {
        f"<{p}t> {UML.sourceState} <{p}a>",
        f"<{p}op> {VDI3682.isAssignedTo} <{p}m>",
        f"<{p}q> {RDF.type} {SOSA.ActuatableProperty}",
        f"<{p}symptom> {DIN17359.SymptomIsExtractedFromFeature} <{p}feature>",
        f"<{p}m> {HS.hasFault} <{p}fault>",
    }
    assert tbox.dump(RdfFormat.N_TRIPLES, graph) == before
    assert bridge(tbox, graph) == added
    assert len(tbox.seeing(added).construct("CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }")) == 5


def test_bridges_are_not_needed_by_our_own_terms(tbox: EmbeddedStore) -> None:
    ours = {term.value for namespace in NAMESPACES for term in namespace}
    compat = tbox.seeing(COMPAT_GRAPH)
    assert not ours & set(kinds(compat))
    assert len(kinds(compat)) == 21


def test_loading_the_ontology_again_changes_nothing(tbox: EmbeddedStore) -> None:
    def sizes() -> list[int]:
        return [len(tbox.dump(RdfFormat.N_TRIPLES, graph).splitlines()) for graph in (ONTOLOGY_GRAPH, COMPAT_GRAPH)]

    before = sizes()
    load_ontology(tbox)
    assert sizes() == before and min(before) > 80
