"""Turtle that depends on the triples alone: sorted subjects, predicates and objects, fixed prefixes, no blank nodes."""

import re
from collections.abc import Iterable
from itertools import groupby
from typing import Final

from pyoxigraph import Literal, NamedNode, Triple

from homeostat.knowledge.vocabulary.vocabulary import PREFIXES, RDF

_LOCAL: Final = re.compile(r"[A-Za-z0-9_]([A-Za-z0-9_.-]*[A-Za-z0-9_-])?")
_BARE: Final = re.compile(r"[+-]?[0-9]+")
_XSD: Final = "http://www.w3.org/2001/XMLSchema#"


def write_turtle(triples: Iterable[Triple], prefix: str, namespace: str) -> bytes:
    """The triples as UTF-8 Turtle; equal sets of triples give equal bytes.

    ``prefix`` stands for the plant's own ``namespace``. Raises ValueError for a blank node, which has no stable name.
    """
    known = ((prefix, namespace), *PREFIXES)
    lines = [f"@prefix {name}: <{iri}> ." for name, iri in sorted(known)]
    for subject, about in groupby(sorted(set(triples), key=_order), key=lambda triple: triple.subject):
        lines += ["", _term(subject, known)]
        by_predicate = [(p, list(group)) for p, group in groupby(about, key=lambda triple: triple.predicate)]
        for number, (predicate, group) in enumerate(by_predicate, start=1):
            verb = "a" if predicate == RDF.type else _term(predicate, known)
            objects = ", ".join(_term(triple.object, known) for triple in group)
            lines.append(f"    {verb} {objects} {'.' if number == len(by_predicate) else ';'}")
    return ("\n".join(lines) + "\n").encode()


def _order(triple: Triple) -> tuple[str, bool, str, str]:
    """Sorts by subject, then the types, then by predicate and object."""
    subject = triple.subject
    if not isinstance(subject, NamedNode):
        raise ValueError(f"subject {subject} has no stable name; a plant's graph has IRIs only")
    return (subject.value, triple.predicate != RDF.type, triple.predicate.value, str(triple.object))


def _term(term: object, known: tuple[tuple[str, str], ...]) -> str:
    if isinstance(term, Literal):
        return _literal(term, known)
    if not isinstance(term, NamedNode):
        raise ValueError(f"term {term} has no stable name; a plant's graph has IRIs and literals only")
    for name, iri in known:
        if term.value.startswith(iri) and _LOCAL.fullmatch(term.value, len(iri)):
            return f"{name}:{term.value[len(iri) :]}"
    return str(term)


def _literal(term: Literal, known: tuple[tuple[str, str], ...]) -> str:
    if term.datatype.value == _XSD + "boolean" and term.value in ("true", "false"):
        return term.value
    if term.datatype.value == _XSD + "integer" and _BARE.fullmatch(term.value):
        return term.value
    plain = str(Literal(term.value))
    if term.language:
        return f"{plain}@{term.language}"
    return plain if term.datatype.value == _XSD + "string" else f"{plain}^^{_term(term.datatype, known)}"
