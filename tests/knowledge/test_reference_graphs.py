"""Published plant graphs are read as they are: our question for transitions, and lint that names what is likely wrong.

The graphs lie outside this repository; without them these tests are skipped, and ``test_foreign_graphs`` claims the
same of two small plants, ``test_lint`` of each kind of finding.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import pytest
from pyoxigraph import NamedNode, RdfFormat, Triple, serialize

from homeostat.knowledge.checks.lint import lint
from homeostat.knowledge.questions import questions
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.error import Code, Mistake
from homeostat.knowledge.store.graph_file import load_file
from homeostat.knowledge.vocabulary.tbox import bridge, declared_terms, load_ontology
from homeostat.knowledge.vocabulary.vocabulary import RDF
from tests.cli.command import homeostat

REFERENCE: Final = Path(__file__).parents[3] / "shared/data/reference"
MIXER: Final = REFERENCE / "knowledge_graphs/mixer_case/MixingModuleKG_v2.jsonld"
REACTOR: Final = REFERENCE / "knowledge_graphs/cstr_case/CSTR_Knowledge_Graph.jsonld"
TERMS: Final = REFERENCE / "ontology_terms.json"
NAMES: Final = "http://example.org/mixer#"
MACHINE: Final = NamedNode(NAMES + "MixerStateMachine")
TRANSITIONS: Final = {
    "condition_init_step": ("state_initialStep", "state_filling_tank_B201"),
    "condition_is_full_tank_B201": ("state_filling_tank_B201", "state_filling_tank_B202"),
    "condition_is_full_tank_B202": ("state_filling_tank_B202", "state_filling_tank_B203"),
    "condition_is_full_tank_B203": ("state_filling_tank_B203", "state_emptying_tank_B201"),
    "condition_is_empty_tank_B201": ("state_emptying_tank_B201", "state_emptying_tank_B202"),
    "condition_is_empty_tank_B202": ("state_emptying_tank_B202", "state_emptying_tank_B203"),
    "condition_is_empty_tank_B203": ("state_emptying_tank_B203", "state_emptying_tank_B204"),
    "condition_is_empty_tank_B204": ("state_emptying_tank_B204", "state_initialStep"),
    "condition_bypass_fault": ("state_filling_tank_B203", "state_bypass_emptying_tank_b201"),
    "condition_bypass_empty_B201": ("state_bypass_emptying_tank_b201", "state_bypass_emptying_tank_b202"),
    "condition_bypass_empty_B202": ("state_bypass_emptying_tank_b202", "state_bypass_emptying_tank_b203"),
    "condition_bypass_empty_B203": ("state_bypass_emptying_tank_b203", "state_emptying_tank_B204"),
}
WITHOUT_CONDITION: Final = {name for name in TRANSITIONS if "bypass" in name}
QUERY: Final = (
    "PREFIX mixer: <http://example.org/mixer#> SELECT ?t { mixer:MixerStateMachine UML:containsTransition ?t }"
)

pytestmark = pytest.mark.reference(
    "published graphs and terms (test_foreign_graphs has made ones)", MIXER, REACTOR, TERMS
)


@pytest.fixture(scope="module")
def mixer() -> EmbeddedStore:
    store = EmbeddedStore()
    load_file(store, MIXER)
    return store


@pytest.fixture(scope="module")
def found(mixer: EmbeddedStore) -> dict[str, Mistake]:
    return {finding.thing: finding for finding in lint(mixer)}


def named(node: NamedNode) -> str:
    return node.value.removeprefix(NAMES)


def test_our_question_returns_the_twelve_transitions(mixer: EmbeddedStore) -> None:
    facts = questions.transitions(mixer, MACHINE)
    assert {named(f.transition): (named(f.source), named(f.target)) for f in facts} == TRANSITIONS
    assert len(facts) == 12
    assert {named(f.transition) for f in facts if f.guard is None and f.event is None} == WITHOUT_CONDITION
    assert {f.guard for f in facts} == {None, "true", "level >= 0.198 m", "level <= 0.022 m", "level <= 0.122 m"}


def test_the_bridges_leave_that_answer_as_it_is() -> None:
    store = EmbeddedStore()
    load_ontology(store)
    graph = NamedNode("urn:file")
    load_file(store, MIXER, graph)
    both = store.seeing(graph, bridge(store, graph))
    assert questions.transitions(both, MACHINE) == questions.transitions(store.seeing(graph), MACHINE)


def test_references_to_nothing_are_named(found: dict[str, Mistake]) -> None:
    dangling = {thing for thing, finding in found.items() if finding.code is Code.DANGLING_REFERENCE}
    tanks = ("B201", "B202", "B203")
    assert {f"individual 'DE_level_start_{tank}'" for tank in tanks} <= dangling
    assert {f"individual 'level_start_{tank}'" for tank in tanks} <= dangling
    assert len(dangling) == 20
    for tank in ("202", "203", "204"):
        message = found[f"individual 'valve_pump_tank_b{tank}'"].message
        assert message.endswith(f"write 'valve_pump_tank_B{tank}', which differs in case only")
    assert (
        "did you mean 'sensor_continuous_volumeFlowRate'"
        in found["individual 'sensor_continuous_volumeFlowRat'"].message
    )


def test_terms_that_nobody_declares_are_named(found: dict[str, Mistake]) -> None:
    unknown = {thing: finding.message for thing, finding in found.items() if finding.code is Code.UNKNOWN_TERM}
    assert "write 'VDI3682:isAssignedTo', which differs in case only" in unknown["property 'VDI3682:isAssignedto'"]
    assert set(unknown) - {thing for thing in unknown if "hasMechanicalInterface:Interface12" in thing} == {
        "property 'CPSMod:IsCharacterizedByParameter'",
        "property 'CPSMod:isAssignedto'",
        "property 'VDI2206:isConnectedWith'",
        "property 'VDI3682:isAssignedto'",
        "property 'VDI3682:processOperatorRealizes'",
    }
    assert len(unknown) == 6


def test_swapped_prefixes_are_named(found: dict[str, Mistake]) -> None:
    swapped = {thing for thing, finding in found.items() if finding.code is Code.SWAPPED_PREFIX}
    assert swapped == {
        "property 'http://example.org/mixer#hasInformationInterface'",
        "individual 'VDI2206:Interface28_pipe0_connectedwith_sensor_continuous_pressure_tank_B201'",
        "individual 'VDI2206:Interface30_pipe4_connectedwith_sensor_continuous_pressure_tank_B203'",
    }


def test_behaviour_that_is_not_stated_is_named(found: dict[str, Mistake]) -> None:
    bare = {thing for thing, finding in found.items() if finding.code is Code.TRANSITION_WITHOUT_CONDITION}
    assert bare == {f"transition {name!r}" for name in WITHOUT_CONDITION}
    assert "marks no state as initial" in found["state machine 'MixerStateMachine'"].message


def test_the_pump_that_was_left_out_is_named(found: dict[str, Mistake]) -> None:
    finding = found["actuator 'bypass_pump_P102'"]
    assert finding.code is Code.UNREACHED_COMPONENT
    assert "no interface (9 of its 9 siblings have one)" in finding.message
    unreached = {thing for thing, finding in found.items() if finding.code is Code.UNREACHED_COMPONENT}
    levels = {f"sensor 'sensor_continuous_level_tank_B20{n}'" for n in (1, 2, 3, 4)}
    assert unreached - levels == {
        "actuator 'bypass_pump_P102'",
        "component 'bypass_pipe_1'",
        "component 'bypass_pipe_2'",
    }
    assert len(found) == 41


def test_the_reactor_graph_is_checked_by_the_same_rules() -> None:
    store = EmbeddedStore()
    load_file(store, REACTOR)
    things = {finding.thing for finding in lint(store)}
    assert {"property 'UML:source'", "individual 'information_dL_dt'", "sensor 'sensor_outlet_FT'"} <= things
    assert len(things) == 12


def test_no_published_term_is_taken_for_a_misspelling() -> None:
    terms = [NamedNode(row["iri"]) for row in json.loads(TERMS.read_text(encoding="utf-8"))]
    others = [term for term in terms if term not in declared_terms()]
    assert len(others) > 10  # of some vocabularies we take a part
    triples = [Triple(NamedNode(f"urn:plant#a{n}"), term, RDF.nil) for n, term in enumerate(others)]
    store = EmbeddedStore()
    store.load(serialize(triples, format=RdfFormat.N_TRIPLES) or b"", RdfFormat.N_TRIPLES)
    assert lint(store) == ()


def test_the_commands_take_the_graph(tmp_path: Path, found: dict[str, Mistake]) -> None:
    checked = homeostat("graph", "check", "--graph", str(MIXER), cwd=tmp_path)
    *lines, last = checked.out.splitlines()
    assert (checked.status, checked.err, last) == (1, "", f"{MIXER}: 41 problems")
    assert lines == [str(finding) for finding in found.values()]
    asked = homeostat("graph", "query", "--graph", str(MIXER), "-e", QUERY, cwd=tmp_path)
    assert asked.status == 0 and len(asked.out.splitlines()) == 14
    exported = homeostat("graph", "export", "--graph", str(MIXER), "--format", "nt", cwd=tmp_path)
    assert exported.status == 0 and len(exported.out.splitlines()) == 3137
