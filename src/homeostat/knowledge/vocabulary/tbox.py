"""The T-Box: the ontologies of this package, and how they get into a store."""

import functools
from importlib import resources
from typing import Final

from pyoxigraph import NamedNode, RdfFormat, Triple, parse

from homeostat.knowledge.questions.query import template
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.vocabulary import RDF, RDFS

ONTOLOGY_GRAPH: Final = NamedNode("urn:homeostat:ontology")
"""Graph that holds the published vocabularies and our extension."""
COMPAT_GRAPH: Final = NamedNode("urn:homeostat:compat")
"""Graph that ties the undefined terms of published plants to defined ones."""

_COMPAT: Final = "compat.ttl"
_OWL: Final = "http://www.w3.org/2002/07/owl#"
_SAME: Final = (RDFS.subPropertyOf, NamedNode(_OWL + "equivalentProperty"), NamedNode(_OWL + "equivalentClass"))
"""How the bridges tie a term to the one it means, in the same direction."""


def ontologies() -> tuple[tuple[str, bytes], ...]:
    """File name and Turtle text of every ontology of this package, the bridges included, sorted by name."""
    files = resources.files(__package__).joinpath("ontology").iterdir()
    return tuple(sorted((file.name, file.read_bytes()) for file in files if file.name.endswith(".ttl")))


def load_ontology(store: GraphStore) -> None:
    """Put the T-Box into ``ONTOLOGY_GRAPH`` and the bridges into ``COMPAT_GRAPH``, replacing what was there."""
    for graph in (ONTOLOGY_GRAPH, COMPAT_GRAPH):
        store.update(f"DROP SILENT GRAPH {graph}")
    for name, text in ontologies():
        store.load(text, RdfFormat.TURTLE, COMPAT_GRAPH if name == _COMPAT else ONTOLOGY_GRAPH)


def bridge(store: GraphStore, source: NamedNode) -> NamedNode:
    """Say what graph ``source`` says in undefined terms again in defined ones; the graph with what was added.

    Needs ``load_ontology`` first. The source is left as it is, so its own queries keep their answers.
    """
    target = NamedNode(f"{source.value}/bridged")
    template("bridge").update(store, bridges=COMPAT_GRAPH, source=source, target=target)
    return target


def declared_terms() -> frozenset[NamedNode]:
    """The terms of the T-Box, and those that the bridges declare without saying that another is meant."""
    typed = (t.subject for t in (*_stated(bridges=False), *_stated(bridges=True)) if t.predicate == RDF.type)
    return frozenset(term for term in typed if isinstance(term, NamedNode)) - meant_terms().keys()


def meant_terms() -> dict[NamedNode, NamedNode]:
    """Terms that published plants use and no vocabulary declares -> the terms that they mean."""
    return {
        triple.subject: triple.object
        for triple in _stated(bridges=True)
        if triple.predicate in _SAME and isinstance(triple.subject, NamedNode) and isinstance(triple.object, NamedNode)
    }


def terms_below(term: NamedNode) -> frozenset[NamedNode]:
    """The class or property and everything that the T-Box says is a plant of it, at any depth."""
    found = {term}
    above = [t for t in _stated(bridges=False) if t.predicate in (RDFS.subClassOf, RDFS.subPropertyOf)]
    while more := {t.subject for t in above if t.object in found and isinstance(t.subject, NamedNode)} - found:
        found |= more
    return frozenset(found)


@functools.cache
def _stated(*, bridges: bool) -> tuple[Triple, ...]:
    return tuple(
        quad.triple
        for name, text in ontologies()
        if (name == _COMPAT) is bridges
        for quad in parse(text, format=RdfFormat.TURTLE)
    )
