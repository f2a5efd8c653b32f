"""Former names of terms, columns and words, each with the name of today; graphs and tables may use either."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from pyoxigraph import NamedNode, Triple

from homeostat.knowledge.vocabulary.vocabulary import HS

TERMS: Final[Mapping[NamedNode, NamedNode]] = {
    NamedNode(f"{HS.iri}Interlock"): HS.TripLimit,
    NamedNode(f"{HS.iri}deadband"): HS.threshold,
}
"""Former IRI -> the term of today."""
COLUMNS: Final[Mapping[str, Mapping[str, str]]] = {"symptoms": {"deadband": "threshold"}}
"""Table -> former name of a column -> its name today."""
WORDS: Final[Mapping[str, Mapping[str, Mapping[str, str]]]] = {"limits": {"kind": {"interlock": "trip limit"}}}
"""Table -> column -> former word -> the word of today."""


def mentioned(content: bytes) -> bool:
    """Whether ``content`` may contain a former term; most graphs do not, and need not be rewritten."""
    return any(term.value.removeprefix(HS.iri).encode() in content for term in TERMS)


def in_terms(triple: Triple, terms: Mapping[NamedNode, NamedNode] = TERMS) -> Triple:
    """``triple`` with property and object as ``terms`` call them; by default former ones as they are called today."""
    verb, value = triple.predicate, triple.object
    if isinstance(value, NamedNode):
        value = terms.get(value, value)
    return Triple(triple.subject, terms.get(verb, verb), value)
