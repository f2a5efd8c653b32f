"""Does a graph have the shape that the system relies on? The shapes of ``shapes/*.ttl``, checked by pySHACL."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Final

from pyoxigraph import NamedNode, RdfFormat, parse

from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.tbox import ontologies
from homeostat.knowledge.vocabulary.vocabulary import RDFS

if TYPE_CHECKING:
    from rdflib import Graph
    from rdflib.term import Node

_SHAPES: Final = "shapes"
_SH: Final = "http://www.w3.org/ns/shacl#"


@dataclass(frozen=True, slots=True)
class Violation:
    """One place where a graph does not have the required shape."""

    shape: str
    """Local name of the shape, or of the constraint where the shape has no name."""
    focus: str
    """Local name of the thing that is wrong."""
    path: str
    """Local name of the property that is wrong; empty where it is the thing itself."""
    value: str
    """The wrong value; empty where one is missing."""
    message: str
    """What is needed."""

    def __str__(self) -> str:
        """One line."""
        found = f" (found {self.value!r})" if self.value else ""
        return f"{self.focus}: {self.message}{found}"


def check_shapes(store: GraphStore, graph: NamedNode | None = None) -> tuple[Violation, ...]:
    """Where ``graph``, or the default graph, breaks a shape; sorted, empty where it conforms.

    Class membership follows the subclass relations of the ontologies and nothing else is inferred.
    """
    import pyshacl
    from rdflib import Graph

    data = _plain_graph()
    data.parse(data=store.dump(RdfFormat.N_TRIPLES, graph), format="nt")
    for triple in _subclasses():
        data.add(triple)
    _, report, _ = pyshacl.validate(data, shacl_graph=_shapes(), inference="none", inplace=True)
    assert isinstance(report, Graph)  # pySHACL returns an exception's text only for a broken shapes graph
    return tuple(sorted(_violations(report), key=lambda item: (item.focus, item.path, item.message, item.value)))


def _plain_graph() -> Graph:
    from rdflib import Graph

    return Graph(bind_namespaces="none")


@cache
def _shapes() -> Graph:
    graph = _plain_graph()
    for file in sorted(resources.files(__package__).joinpath(_SHAPES).iterdir(), key=lambda file: file.name):
        if file.name.endswith(".ttl"):
            graph.parse(data=file.read_bytes(), format="turtle")
    return graph


@cache
def _subclasses() -> list[tuple[Node, Node, Node]]:
    from rdflib import URIRef

    return [
        (URIRef(triple.subject.value), URIRef(RDFS.subClassOf.value), URIRef(triple.object.value))
        for _, text in ontologies()
        for triple in parse(text, format=RdfFormat.TURTLE)
        if triple.predicate == RDFS.subClassOf
        and isinstance(triple.subject, NamedNode)
        and isinstance(triple.object, NamedNode)
    ]


def _violations(report: Graph) -> list[Violation]:
    from rdflib import BNode, URIRef
    from rdflib.namespace import RDF

    def local(node: Node, name: str) -> str:
        value = report.value(node, URIRef(_SH + name))
        return "" if value is None or isinstance(value, BNode) else str(value).rpartition("#")[2]

    return [
        Violation(
            shape=local(result, "sourceShape") or local(result, "sourceConstraintComponent"),
            focus=local(result, "focusNode"),
            path=local(result, "resultPath"),
            value=local(result, "value"),
            message=str(report.value(result, URIRef(_SH + "resultMessage")) or ""),
        )
        for result in report.subjects(RDF.type, URIRef(_SH + "ValidationResult"))
    ]
