"""The T-Box: the ontologies of this package, and how they get into a store."""

from __future__ import annotations

from importlib import resources
from typing import Final

from pyoxigraph import NamedNode, RdfFormat

from .query import template
from .store import GraphStore

ONTOLOGY_GRAPH: Final = NamedNode("urn:homeostat:ontology")
"""Graph that holds the published vocabularies and our extension."""
COMPAT_GRAPH: Final = NamedNode("urn:homeostat:compat")
"""Graph that ties the undefined terms of published plants to defined ones."""

_COMPAT: Final = "compat.ttl"


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
