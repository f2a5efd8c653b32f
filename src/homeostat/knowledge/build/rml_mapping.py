"""The part of RML-Core that the plants' mappings use, read into typed maps.

Supported: CSV sources, constants, references, templates, term types, datatypes, languages, classes, and the shortcuts
``rml:predicate`` and ``rml:object``. Anything else is refused, so that no part of a mapping is ignored silently.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias
from urllib.parse import quote

from pyoxigraph import BlankNode, Literal, NamedNode, RdfFormat, parse

from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.vocabulary.vocabulary import RDF

_RML: Final = "http://w3id.org/rml/"
_PLACE: Final = re.compile(r"\{([^{}]+)\}")
_TERM_MAP: Final = frozenset({"constant", "reference", "template", "termType", "datatype", "language", "class"})
_PAIR: Final = frozenset({"predicate", "predicateMap", "object", "objectMap"})
_SOURCE: Final = frozenset({"source", "referenceFormulation"})
_MAP: Final = frozenset({"logicalSource", "subjectMap", "predicateObjectMap"})

_Node: TypeAlias = NamedNode | BlankNode | Literal
_Index: TypeAlias = Mapping[NamedNode | BlankNode, tuple[tuple[str, _Node], ...]]


@dataclass(frozen=True, slots=True)
class TermMap:
    """How one term is made from a row."""

    constant: NamedNode | Literal | None = None
    """The term itself."""
    reference: str | None = None
    """Column whose cell is the term."""
    template: str | None = None
    """Text with columns in braces; in an IRI the cells are percent-encoded."""
    literal: bool = True
    """Whether the term is a literal; otherwise an IRI."""
    datatype: NamedNode | None = None
    """Datatype of the literal."""
    language: str | None = None
    """Language of the literal."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns that it reads."""
        return (self.reference,) if self.reference else tuple(_PLACE.findall(self.template or ""))

    def term(self, row: Mapping[str, str]) -> NamedNode | Literal | None:
        """The term for ``row``; None where one of its cells is empty."""
        if self.constant is not None:
            if isinstance(self.constant, Literal) and (self.datatype or self.language):
                return self._literal(self.constant.value)
            return self.constant
        if not all(row[column] for column in self.columns):
            return None
        if self.reference:
            text = row[self.reference]
        else:
            encode = (lambda cell: cell) if self.literal else (lambda cell: quote(cell, safe=""))
            text = _PLACE.sub(lambda place: encode(row[place[1]]), self.template or "")
        return self._literal(text) if self.literal else NamedNode(text)

    def _literal(self, text: str) -> Literal:
        return Literal(text, language=self.language) if self.language else Literal(text, datatype=self.datatype)


@dataclass(frozen=True, slots=True)
class TriplesMap:
    """What every row of one table says about one subject."""

    name: str
    """IRI of the map, for messages."""
    source: str
    """File of the table, relative to the folder of the mapping."""
    subject: TermMap
    """What the row is about."""
    pairs: tuple[tuple[TermMap, TermMap], ...]
    """Predicates and objects; classes are pairs with ``rdf:type``."""

    @property
    def columns(self) -> frozenset[str]:
        """Columns that it reads."""
        terms = (self.subject, *(term for pair in self.pairs for term in pair))
        return frozenset(column for term in terms for column in term.columns)


def read_mapping(text: bytes) -> tuple[TriplesMap, ...]:
    """The triples maps of an RML mapping in Turtle, sorted by name; GraphError where something is not supported."""
    index: dict[NamedNode | BlankNode, tuple[tuple[str, _Node], ...]] = {}
    try:
        for triple in parse(text, format=RdfFormat.TURTLE):
            predicate = triple.predicate.value
            entry = ("a" if predicate == RDF.type.value else predicate.removeprefix(_RML), triple.object)
            index[triple.subject] = (*index.get(triple.subject, ()), entry)
    except SyntaxError as error:
        raise GraphError(Code.BAD_MAPPING, "mapping", f"is not Turtle: {error}") from error
    found = [node for node, entries in index.items() if ("a", NamedNode(_RML + "TriplesMap")) in entries]
    return tuple(_triples_map(node, index) for node in sorted(found, key=str))


def _triples_map(node: NamedNode | BlankNode, index: _Index) -> TriplesMap:
    name = node.value
    parts = _entries(node, index, _MAP, name)
    source_node, subject_node = _one(parts, "logicalSource", name), _one(parts, "subjectMap", name)
    source = _entries(source_node, index, _SOURCE, name)
    if _one(source, "referenceFormulation", name) != NamedNode(_RML + "CSV"):
        raise GraphError(Code.BAD_MAPPING, name, "only rml:CSV sources are supported")
    classes = [value for key, value in _entries(subject_node, index, _TERM_MAP, name) if key == "class"]
    kind = TermMap(constant=RDF.type)
    pairs = [(kind, _constant(value, name)) for value in classes]
    for key, pair in parts:
        if key == "predicateObjectMap":
            entries = _entries(pair, index, _PAIR, name)
            predicate = _either(entries, "predicate", index, name, literal=False)
            pairs.append((predicate, _either(entries, "object", index, name, literal=True)))
    path = _one(source, "source", name)
    if not isinstance(path, Literal):
        raise GraphError(Code.BAD_MAPPING, name, "rml:source must be the path of a table, as text")
    return TriplesMap(name, path.value, _term_map(subject_node, index, name, literal=False), tuple(pairs))


def _either(entries: tuple[tuple[str, _Node], ...], word: str, index: _Index, name: str, literal: bool) -> TermMap:
    if any(key == word for key, _ in entries):
        return _constant(_one(entries, word, name), name)
    return _term_map(_one(entries, f"{word}Map", name), index, name, literal)


def _term_map(node: _Node, index: _Index, name: str, literal: bool) -> TermMap:
    parts = dict(_entries(node, index, _TERM_MAP, name))
    ways = [key for key in ("constant", "reference", "template") if key in parts]
    if len(ways) != 1:
        raise GraphError(Code.BAD_MAPPING, name, "a term map needs one of rml:constant, rml:reference, rml:template")
    datatype, language = parts.get("datatype"), parts.get("language")
    if "termType" in parts:
        literal = parts["termType"] == NamedNode(_RML + "Literal")
    elif ways == ["template"]:
        literal = datatype is not None or language is not None
    return TermMap(
        constant=_constant(parts["constant"], name).constant if "constant" in parts else None,
        reference=parts["reference"].value if "reference" in parts else None,
        template=parts["template"].value if "template" in parts else None,
        literal=literal,
        datatype=datatype if isinstance(datatype, NamedNode) else None,
        language=language.value if isinstance(language, Literal) else None,
    )


def _constant(node: _Node, name: str) -> TermMap:
    if isinstance(node, BlankNode):
        raise GraphError(Code.BAD_MAPPING, name, "a constant must be an IRI or a literal")
    return TermMap(constant=node)


def _entries(node: _Node, index: _Index, known: frozenset[str], name: str) -> tuple[tuple[str, _Node], ...]:
    entries = () if isinstance(node, Literal) else index.get(node, ())
    for key, _ in entries:
        if key != "a" and key not in known:
            raise GraphError(
                Code.BAD_MAPPING, name, f"{key!r} is not supported here; known are {', '.join(sorted(known))}"
            )
    return entries


def _one(entries: tuple[tuple[str, _Node], ...], key: str, name: str) -> _Node:
    found = [value for entry, value in entries if entry == key]
    if len(found) != 1:
        raise GraphError(Code.BAD_MAPPING, name, f"needs exactly one rml:{key}, has {len(found)}")
    return found[0]
