"""The graph of a site: what it holds, and what an agent is shown of one module in it."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from pyoxigraph import NamedNode, Triple

from benchmarks.scale.header_graph import HEADERS, SITE
from benchmarks.scale.module_case import TimedStore, module_case
from benchmarks.scale.plant_graph import (
    GROUP,
    KINDS,
    group_of,
    kind_of,
    load_site,
    module_text,
    namespace,
    site_triples,
)
from benchmarks.scale.retrieval import UNLIMITED, context
from homeostat.agents.grounding.grounding import Grounding
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.knowledge.checks.conformance import check_shapes
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.vocabulary.vocabulary import M
from homeostat.plants.plant import Plant, load_plant

MODULES = 12
"""Two groups of headers, the second with two modules."""
PLACE = re.compile(r"urn:homeostat:site:m(\d+)#([^>\s]*)")


@pytest.fixture(scope="module")
def site() -> EmbeddedStore:
    return load_site(MODULES)


@pytest.fixture(scope="module")
def cases() -> dict[str, Plant]:
    return {kind: load_plant(kind) for kind in KINDS}


def triples(store: EmbeddedStore) -> int:
    return int(store.select("SELECT (COUNT(*) AS ?n) { ?s ?p ?o }")[0].number("n"))


def test_a_site_holds_everything_that_its_cases_say_and_its_headers(site: EmbeddedStore) -> None:
    said = {line: k for k in (1, 2) for line in module_text(k, kind_of(k)).splitlines()}
    own = [line for line, k in said.items() if line.startswith(f"<{namespace(k)}".encode())]
    # Symbols of OpenMath and units belong to nobody: each is there once, however many modules have it.
    interior = (MODULES // 2) * len(own) + len(said) - len(own)
    assert triples(site) == interior + len(set(site_triples(MODULES)) - set(symbol_triples()))
    assert (triples(site) - triples(load_site(2))) / (MODULES - 2) > 4_690, "a thousand modules need a million triples"


def symbol_triples() -> Iterator[Triple]:
    """What a site's equations say of OpenMath's symbols, as the cases' do."""
    return (t for t in site_triples(MODULES) if t.object == M.Symbol)


def test_a_site_keeps_every_shape() -> None:
    assert check_shapes(load_site(2)) == ()


@pytest.mark.parametrize("module", [1, 2, 11, 12])
def test_a_module_describes_itself_as_its_case_does(site: EmbeddedStore, cases: dict[str, Plant], module: int) -> None:
    plant = cases[kind_of(module)]
    assert module_case(plant, site, module).description == plant.description


@pytest.mark.parametrize("module", [5, 6, 12])
def test_a_context_shows_headers_and_of_neighbours_their_product_streams_only(
    site: EmbeddedStore, cases: dict[str, Plant], module: int
) -> None:
    texts = [shown.text for shown in context(module_case(cases[kind_of(module)], site, module))]
    assert any(SITE in text for text in texts), "no header in any context"
    others = {found for text in texts for found in PLACE.findall(text)}
    assert {int(number) for number, _ in others} == {
        k for k in range(1, MODULES + 1) if group_of(k) == group_of(module) and k != module
    }
    assert {name for _, name in others} <= {"flow_product", "flow_product_stream"}


def test_headers_of_other_groups_are_not_shown(site: EmbeddedStore, cases: dict[str, Plant]) -> None:
    shown = "\n".join(s.text for s in context(module_case(cases[kind_of(12)], site, 12)))
    assert "CW002" in shown and "CW001" not in shown


def test_without_headers_a_context_is_that_of_the_case(site: EmbeddedStore, cases: dict[str, Plant]) -> None:
    alone, within = (context(plant) for plant in (cases["cstr"], module_case(cases["cstr"], site, 4)))
    for bare, coupled in zip(alone, within, strict=True):
        lines = coupled.text.splitlines()
        assert set(bare.text.splitlines()) - set(lines) == {
            line for line in bare.text.splitlines() if line.startswith(":operator_") and line not in lines
        }
        assert {line.split(" ")[0] for line in bare.text.splitlines()} <= {line.split(" ")[0] for line in lines}


def test_a_context_does_not_depend_on_the_rest_of_the_plant(cases: dict[str, Plant], site: EmbeddedStore) -> None:
    full = load_site(GROUP)
    for module in (3, 4):
        plant = cases[kind_of(module)]
        assert context(module_case(plant, site, module)) == context(module_case(plant, full, module))


def test_faults_and_paths_are_answered_as_for_the_case(site: EmbeddedStore, cases: dict[str, Plant]) -> None:
    plant = cases["cstr"]
    machine: StateMachine = plant.description.machine
    asked = [Grounding(plant.graph, plant.namespace), Grounding(site, namespace(8))]
    for rule in plant.description.symptom_rules:
        alone, within = (g.candidate_faults([rule.name]) for g in asked)
        assert alone == within
    for transition in machine.transitions:
        for fault in plant.description.faults:
            path = (transition.source, transition.target)
            alone, within = (g.allows(path, [fault.name]) for g in asked)
            assert alone == within


def test_every_header_reaches_every_module_that_uses_it(site: EmbeddedStore) -> None:
    for header in HEADERS:
        for module in range(1, MODULES + 1):
            operator = NamedNode(f"{SITE}operator_{header.name}{group_of(module):03d}")
            tied = [*header.users.get(kind_of(module), ()), *header.givers.get(kind_of(module), ())]
            for name in tied:
                own = NamedNode(f"{namespace(module)}operator_{name}")
                assert site.ask(f"ASK {{ {operator} ?p {own} . {own} ?q {operator} }}")


def test_a_timed_store_answers_as_the_store_and_counts(site: EmbeddedStore) -> None:
    timed = TimedStore(site)
    grounding = Grounding(timed, namespace(2))
    shown = grounding.step_context("reduced_load", (), UNLIMITED)
    assert shown == Grounding(site, namespace(2)).step_context("reduced_load", (), UNLIMITED)
    assert len(timed.took_ms) == 1 and timed.median_ms > 0.0
