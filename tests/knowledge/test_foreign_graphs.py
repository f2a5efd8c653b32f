"""Plant graphs that were not made here: read as they are, asked by questions of others and of ours, and linted.

Two small plants, written by hand in the manner of the published ones: their own named graphs, misspelt terms, a
reference to nothing. ``test_interop`` and ``test_reference_graphs`` claim the same of the published graphs themselves,
which are not part of this project. What a query must answer is what rdflib's engine answers, which shares no code.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
import rdflib
from pyoxigraph import NamedNode, RdfFormat, Triple
from rdflib.compare import to_isomorphic

from homeostat.knowledge.checks.lint import lint
from homeostat.knowledge.questions import questions
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.error import Code
from homeostat.knowledge.store.graph_file import load_file
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.tbox import bridge, load_ontology
from homeostat.knowledge.vocabulary.vocabulary import DIN17359, HS, UML, VDI3682
from tests.cli.command import homeostat
from tests.knowledge.servers import STORES, empty_store

FILE: Final = Path(__file__).with_name("dosing_station.jsonld")
DOSING: Final = NamedNode("http://example.org/graphs/dosing")
HEATER: Final = NamedNode("http://example.org/graphs/heater")
NAMES: Final = "http://example.org/dosing#"
PREFIXES: Final = """
PREFIX : <http://example.org/dosing#>
PREFIX UML: <http://www.hsu-ifa.de/ontologies/UMLStateMachine#>
PREFIX VDI2206: <http://www.w3id.org/hsu-aut/VDI2206#>
PREFIX VDI3682: <http://www.w3id.org/hsu-aut/VDI3682#>
PREFIX CPSMod: <http://www.hsu-ifa.de/ontologies/CPSMod#>
PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#>
"""
PLANNING: Final = f"""{PREFIXES}
CONSTRUCT {{
  ?po VDI3682:isAssignedto ?module ; rdfs:label ?po_label .
  ?s a UML:State ; rdfs:label ?s_label ; UML:doAction ?a .
  ?tr a UML:Transition ; UML:sourceState ?s ; UML:targetState ?t ; UML:transitionEvent ?e ; UML:transitionGuard ?g ;
      rdfs:comment ?why .
}}
WHERE {{ GRAPH <http://example.org/graphs/dosing> {{
  ?po VDI3682:isAssignedto ?module ; CPSMod:processRealizesBehavior ?machine ; rdfs:label ?po_label .
  OPTIONAL {{ ?machine UML:initialState ?first }}
  BIND(COALESCE(?first, :waiting) AS ?start)
  ?start ((^UML:sourceState|^UML:targetState)/(UML:sourceState|UML:targetState))* ?s .
  ?tr a UML:Transition ; UML:sourceState ?s ; UML:targetState ?t .
  OPTIONAL {{ ?tr UML:transitionEvent ?e }}
  OPTIONAL {{ ?tr UML:transitionGuard ?g }}
  OPTIONAL {{ ?tr rdfs:comment ?why }}
  OPTIONAL {{ ?s rdfs:label ?s_label }}
  OPTIONAL {{ ?s UML:doAction ?a . ?a a UML:Action }}
}} }}"""
NAMED: Final = 'BIND(REPLACE(STR(?actuator), ".*[/#]", "") AS ?name)'
ACTION: Final = f"""{PREFIXES}
CONSTRUCT {{ ?a CPSMod:isChangedByActuator ?actuator . ?actuator :localName ?name ; :travel_s ?travel . }}
WHERE {{ GRAPH <http://example.org/graphs/dosing> {{
  ?state UML:doAction ?a .
  OPTIONAL {{
    {{ ?a CPSMod:isChangedByActuator ?actuator }} UNION {{ ?actuator CPSMod:isChangedByActuator ?a }}
    ?actuator a VDI2206:Actuator
  }}
  OPTIONAL {{ ?actuator :travel_s ?travel }}
  {NAMED}
}} }}"""

# rdflib's parser uses names that rdflib deprecates.
pytestmark = pytest.mark.filterwarnings("ignore:(Dataset|ConjunctiveGraph):DeprecationWarning")


@pytest.fixture(scope="module", params=STORES)
def store(
    request: pytest.FixtureRequest, oxigraph: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[GraphStore]:
    """Every kind of store, with the file as it is."""
    with empty_store(request.param, oxigraph, tmp_path_factory.mktemp("store")) as store:
        store.load(FILE.read_bytes(), RdfFormat.JSON_LD)
        yield store


@pytest.fixture(scope="module")
def dosing() -> EmbeddedStore:
    """The dosing station alone, as the default graph."""
    store = EmbeddedStore()
    load_file(store, FILE)
    return store


def graph_of(triples: tuple[Triple, ...]) -> rdflib.Graph:
    """The triples for rdflib."""
    return rdflib.Graph().parse(data="".join(f"{triple} .\n" for triple in triples), format="nt")


def expected(query: str) -> rdflib.Graph:
    """What rdflib answers to a query on the file."""
    answer = rdflib.Dataset().parse(data=FILE.read_text("utf-8"), format="json-ld").query(query).graph
    assert answer is not None
    return answer


def same(triples: tuple[Triple, ...], graph: rdflib.Graph) -> bool:
    """Whether both are one graph, literals compared by value."""
    return bool(to_isomorphic(graph_of(triples)) == to_isomorphic(graph))


def test_the_graphs_are_complete(store: GraphStore) -> None:
    for graph, size in ((DOSING, 63), (HEATER, 16)):
        (row,) = store.select(f"SELECT (COUNT(*) AS ?n) {{ GRAPH {graph} {{ ?s ?p ?o }} }}")
        assert row.number("n") == size
    assert not store.ask("ASK { ?s ?p ?o }")


def test_a_question_for_planning_is_answered_as_elsewhere(store: GraphStore) -> None:
    triples = store.construct(PLANNING)
    assert len(triples) == 24 and same(triples, expected(PLANNING))


def test_a_question_for_action_is_answered_as_elsewhere(store: GraphStore) -> None:
    triples = store.construct(ACTION)
    assert len(triples) == 5 and same(triples, expected(ACTION))


def test_a_name_that_is_computed_where_its_variable_is_unknown_is_left_out(store: GraphStore) -> None:
    """By SPARQL 1.1 the bound variable is out of scope inside an OPTIONAL; RDF4J answers otherwise."""
    misplaced = ACTION.replace(NAMED, f"OPTIONAL {{ {NAMED} }}")
    triples = store.construct(misplaced)
    assert same(triples, expected(misplaced))
    missing = set(store.construct(ACTION)) - set(triples)
    assert {t.predicate.value for t in missing} == {f"{NAMES}localName"} and len(missing) == 1


def test_bridges_say_it_in_the_standard_terms_and_leave_the_answers_as_they_are(store: GraphStore) -> None:
    before = store.construct(PLANNING)
    load_ontology(store)
    added = {graph: bridge(store, graph) for graph in (DOSING, HEATER)}

    def count(graph: NamedNode, predicate: NamedNode) -> float:
        (row,) = store.select(f"SELECT (COUNT(*) AS ?n) {{ GRAPH {added[graph]} {{ ?s {predicate} ?o }} }}")
        return row.number("n")

    assert count(DOSING, VDI3682.isAssignedTo) == 1
    assert count(HEATER, UML.sourceState) == count(HEATER, UML.targetState) == count(HEATER, UML.containsState) == 2
    assert count(HEATER, DIN17359.SymptomIndicatesFault) == count(HEATER, HS.hasFault) == 1
    assert count(HEATER, HS.isConnectedTo) == 1
    assert store.construct(PLANNING) == before


def test_our_question_returns_the_transitions(dosing: EmbeddedStore) -> None:
    facts = questions.transitions(dosing, NamedNode(f"{NAMES}machine"))
    name = len(NAMES)
    assert [(f.transition.value[name:], f.source.value[name:], f.target.value[name:], f.guard) for f in facts] == [
        ("t_empty", "draining", "waiting", None),
        ("t_full", "filling", "draining", "level >= 0.31 m"),
        ("t_start", "waiting", "filling", "true"),
    ]
    assert [f.event and f.event.value[name:] for f in facts] == [None, None, "asked"]


def test_the_bridges_leave_that_answer_as_it_is() -> None:
    store, graph = EmbeddedStore(), NamedNode("urn:file")
    load_ontology(store)
    load_file(store, FILE, graph)
    both, machine = store.seeing(graph, bridge(store, graph)), NamedNode("http://example.org/dosing#machine")
    assert questions.transitions(both, machine) == questions.transitions(store.seeing(graph), machine)


def test_what_is_likely_wrong_is_named(dosing: EmbeddedStore) -> None:
    """Each kind once for each mistake that was made, and nothing else."""
    found = [(finding.code, finding.thing) for finding in lint(dosing)]
    machine = (Code.BAD_INITIAL_STATE, "state machine 'machine'")
    assert sorted(found) == sorted([
        *((Code.UNKNOWN_TERM, f"property '{term}'") for term in (
            "DIN17359:DiagnosticSubjectHasFault", "DIN17359:SymptomDescribesFault", "UML:contains", "UML:source",
            "UML:target", "VDI2206:isConnectedWith", "VDI3682:isAssignedto",
        )),
        (Code.DANGLING_REFERENCE, "individual 'valve_out_a1'"),
        *((Code.TRANSITION_WITHOUT_CONDITION, f"transition '{name}'") for name in ("t_empty", "t_off", "t_on")),
        machine, machine,
        (Code.UNREACHED_COMPONENT, "actuator 'pump_rinse'"),
    ])  # fmt: skip


def test_the_commands_take_the_file(tmp_path: Path, dosing: EmbeddedStore) -> None:
    checked = homeostat("graph", "check", "--graph", str(FILE), cwd=tmp_path)
    *lines, last = checked.out.splitlines()
    assert (checked.status, checked.err, last) == (1, "", f"{FILE}: 14 problems")
    assert lines == [str(finding) for finding in lint(dosing)]
    query = f"PREFIX : <{NAMES}> SELECT ?t {{ :machine UML:containsTransition ?t }}"
    asked = homeostat("graph", "query", "--graph", str(FILE), "-e", query, cwd=tmp_path)
    assert asked.status == 0 and len(asked.out.splitlines()) == 3 + 2
    exported = homeostat("graph", "export", "--graph", str(FILE), "--format", "nt", cwd=tmp_path)
    assert exported.status == 0 and len(exported.out.splitlines()) == 63 + 16
