"""A plant whose every text says what an attacker wants: labels, comments, alarm texts, names, sources."""

from __future__ import annotations

from dataclasses import replace

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, parse, serialize

from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.vocabulary.vocabulary import HS, RDFS, UML, VDI3682
from homeostat.plants.files.folder import INSTALLED
from homeostat.plants.plant import Plant

TEXTS = (RDFS.label, RDFS.comment, HS.source, HS.requirementReason, UML.stateName, VDI3682.shortName)
"""Properties whose values are text for people."""


def poisoned(plant: Plant, text: str) -> Plant:
    """``case`` with ``text`` in every text of its graph, and in the names of its equipment."""
    graph = (INSTALLED / plant.name / "plant.ttl").read_bytes()
    triples = [_poison(quad.triple, plant.namespace, text) for quad in parse(graph, RdfFormat.TURTLE)]
    store = EmbeddedStore()
    data = serialize(triples, format=RdfFormat.N_TRIPLES)
    assert data is not None
    store.load(data, RdfFormat.N_TRIPLES)
    system = NamedNode(f"{plant.namespace}system")
    return replace(plant, graph=store, description=read_plant(store, system))


def _poison(triple: Triple, namespace: str, text: str) -> Triple:
    assert isinstance(triple.subject, NamedNode)
    if triple.predicate in TEXTS:
        return Triple(triple.subject, triple.predicate, Literal(text, language="en"))
    if triple.predicate == HS.name and triple.subject.value.startswith(f"{namespace}equipment_"):
        name = triple.subject.value.rpartition("_")[2]
        return Triple(triple.subject, triple.predicate, Literal(f"{text} {name}"))
    return triple
