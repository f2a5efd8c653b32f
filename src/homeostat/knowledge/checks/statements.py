"""What a graph says about individuals, with the vocabularies at hand: for checks that know no plant."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, TypeAlias

from pyoxigraph import BlankNode, Literal, NamedNode, RdfFormat, Triple, parse

from homeostat.domain.quotation import quoted
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.tbox import declared_terms, meant_terms
from homeostat.knowledge.vocabulary.vocabulary import PREFIXES, RDF, RDFS

Thing: TypeAlias = NamedNode | BlankNode
"""What a graph can say something about."""

OWL: Final = "http://www.w3.org/2002/07/owl#"
BASIC: Final = (RDF.iri, RDFS.iri, OWL)
"""Namespaces of the languages in which vocabularies are written."""
SHOWN: Final = 160
"""Characters of a name that are shown."""


@dataclass(frozen=True, slots=True)
class Statements:
    """A graph without the vocabularies in it, and the terms that it may use."""

    facts: tuple[Triple, ...]
    """What is said about individuals, in the words of the graph, sorted."""
    individuals: frozenset[NamedNode]
    """Everything with a name that something is said about."""
    declared: frozenset[NamedNode]
    """Terms that our T-Box declares, or a vocabulary inside the graph."""
    said: dict[Thing, dict[NamedNode, tuple[object, ...]]]
    """Individual -> property -> values, where terms that no vocabulary declares are replaced by those they mean."""

    def of_kind(self, kind: NamedNode) -> Iterator[Thing]:
        """The individuals that are stated to be of exactly this kind, in the order of their names."""
        return (thing for thing, about in self.said.items() if kind in about.get(RDF.type, ()))

    def values(self, thing: object, *properties: NamedNode) -> tuple[object, ...]:
        """What the individual has for any of the properties; nothing where the graph does not describe it."""
        about = self.said.get(thing, {}) if isinstance(thing, NamedNode | BlankNode) else {}
        return tuple(value for term in properties for value in about.get(term, ()))


def read_statements(store: GraphStore, graph: NamedNode | None = None) -> Statements:
    """What ``graph``, or the default graph, says."""
    dump = store.dump(RdfFormat.N_TRIPLES, graph)
    triples = sorted({quad.triple for quad in parse(dump, format=RdfFormat.N_TRIPLES)}, key=str)
    own = {triple.subject for triple in triples if triple.predicate == RDF.type and _is_schema(triple.object)}
    # A list or a restriction of a vocabulary has no type, or only one of those languages.
    typed = {triple.subject for triple in triples if triple.predicate == RDF.type}
    declared = declared_terms() | {term for term in own if isinstance(term, NamedNode)}
    schema = declared | own
    facts = tuple(t for t in triples if t.subject not in schema and not _is_part_of_schema(t.subject, typed))
    return Statements(
        facts=facts,
        individuals=frozenset(t.subject for t in facts if isinstance(t.subject, NamedNode)),
        declared=declared,
        said=_in_standard_terms(facts, declared),
    )


def _is_schema(kind: object) -> bool:
    return (
        isinstance(kind, NamedNode)
        and kind.value.startswith(BASIC)
        and kind.value not in (f"{OWL}NamedIndividual", f"{OWL}Thing")
    )


def _is_part_of_schema(thing: object, typed: set[Thing]) -> bool:
    return (isinstance(thing, BlankNode) and thing not in typed) or (
        isinstance(thing, NamedNode) and thing.value.startswith(BASIC)
    )


def _in_standard_terms(
    facts: tuple[Triple, ...], declared: frozenset[NamedNode]
) -> dict[Thing, dict[NamedNode, tuple[object, ...]]]:
    meant = {used: term for used, term in meant_terms().items() if used not in declared}
    said: dict[Thing, dict[NamedNode, tuple[object, ...]]] = {}
    for fact in facts:
        assert isinstance(fact.subject, NamedNode | BlankNode)  # no format that is read has triples about triples
        about = said.setdefault(fact.subject, {})
        term = meant.get(fact.predicate, fact.predicate)
        about[term] = (*about.get(term, ()), fact.object)
    return said


def split(term: NamedNode) -> tuple[str, str]:
    """Namespace and local name; an empty namespace where the IRI has none."""
    found = re.match(r".*[#/]", term.value)
    return (found[0], term.value[found.end() :]) if found else ("", term.value)


def full_name(term: NamedNode) -> str:
    """The name with its prefix; the whole IRI where the project has no prefix for it."""
    space, local = split(term)
    prefix = next((prefix for prefix, iri in PREFIXES if iri == space), None)
    return quoted(term.value if prefix is None else f"{prefix}:{local}", SHOWN)


def local_name(thing: object) -> str:
    """The end of the name, which tells things of one plant apart."""
    if isinstance(thing, NamedNode):
        return quoted(split(thing)[1] or thing.value, SHOWN)
    return quoted(thing.value, SHOWN) if isinstance(thing, Literal) else "(no name)"
